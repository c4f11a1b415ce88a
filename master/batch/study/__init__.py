"""Studies: a family of variants of one scenario, run one after the other and reported side by side."""
