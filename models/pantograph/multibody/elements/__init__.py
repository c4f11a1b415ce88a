"""What a mechanism is made of: points and axes that move with a body, rotations, joints, force elements.

The room may import a mechanism's definition, and knows no system of equations.
"""
