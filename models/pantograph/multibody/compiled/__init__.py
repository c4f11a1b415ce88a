"""The general form of a mechanism's equations of motion, compiled: its elements as tables, and kernels over them."""
