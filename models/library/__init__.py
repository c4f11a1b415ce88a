"""The definitions of lines and pantographs that come along, one readable file each, and what finds and reads them.

``lines`` and ``pantographs`` hold the files, `catalogue` turns a name or the path of a file into a definition. The room
may import the readers of the catenary, of the pantographs and of definition files.
"""
