"""The command line ``python -m master``: one file for each verb or pair of verbs; each declares itself to ``main``.

Imports every room of the master; nothing imports it but ``__main__`` and the command `openpanto`.
"""
