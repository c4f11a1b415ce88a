"""Nothing is lost and nobody is stuck: safe files, arrays in bytes, locks of folders, signals, supervision.

Imports the errors alone.
"""
