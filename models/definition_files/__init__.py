"""What every definition of a line or a pantograph is made of: values with unit, range and source.

`toml_reader` reads a file and collects its mistakes, `si_units` converts once, at the edge, `parameter` is one tunable
number, and `field_schema` has dataclasses declare their fields: one declaration reads, lists and changes them.
`message_text` makes what was written fit for a message.

May import arrays alone.
"""
