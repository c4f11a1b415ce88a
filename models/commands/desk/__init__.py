"""One page for the designer of a line: what a verb has found, with figures and tables, to be read, printed and kept.

A page is one file that asks no network for anything. Its markup stands here and not with the pages of runs
(`master/report`), since neither package imports the other and those pages are made of charts that a script draws.
"""
