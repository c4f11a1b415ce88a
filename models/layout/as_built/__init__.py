"""A line as it hangs: a measuring run laid on the design, dropper lengths as fitted, and what to correct.

May import `layout`'s tables, the catenary and the definition files; no page and no command. As large as a room may be:
it is one way through, from rows of a table to the changes of droppers.
"""
