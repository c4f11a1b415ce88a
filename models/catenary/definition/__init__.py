"""What a line is: frozen data in SI, and how a definition file becomes them, checked.

May import arrays, definition files and the contact law (the names of the laws), nothing else of the catenary.
"""
