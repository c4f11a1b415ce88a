"""A line as it hangs: a measuring run laid on the design, dropper lengths as fitted, and what to correct.

May import `layout`'s tables, the catenary and the definition files; no page and no command.
"""
