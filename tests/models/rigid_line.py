"""A line that does not move under a strip, and how a pantograph presses on a wavy running surface of it."""

from pathlib import Path

import numpy as np

from models.pantograph.lumped.lumped_model import LumpedModel

SPEED, STIFFNESS = 300.0 / 3.6, 20000.0
#: Wires that are beams of 100 kN.m2 on supports 1 m apart, clamped together by droppers that push as well as pull.
_LINE = """
name = "rigid"
type = "simple"
profile = { contact_wire_height = [5.08, "m", "test"], encumbrance = [1.4, "m", "test"] }
dropper = { stiffness = [1e8, "N/m", "test"], mass = [0, "kg/m", "test"], compression_ratio = [1, "1", "test"] }
mesh = { elements_between_droppers = 1 }
damping = { alpha = [1e-4, "s", "test"], beta = [0, "1/s", "test"] }
stagger = { amplitude = [0, "m", "test"] }
running_surface = { profile = "wave.csv" }
[spans]
start = [0, "m", "test"]
length = [1, "m", "test"]
count = COUNT
periodic = true
droppers = { first = [0.25, "m", "test"], count = 2 }
[steady_arm]
area = [120, "mm2", "test"]
mass = [1.07, "kg/m", "test"]
youngs_modulus = [84.7, "GPa", "test"]
length = [1.22, "m", "test"]
angle = [-10, "deg", "test"]
"""
_WIRE = """
[WIRE_wire]
area = [1000, "mm2", "test"]
mass = [20, "kg/m", "test"]
youngs_modulus = [200, "GPa", "test"]
tension = [10, "kN", "test"]
bending_stiffness = [1e5, "N.m2", "test"]
"""


def write_rigid_line(folder: Path, spans: int, wavelength: float, height: float) -> Path:
    """Write the definition of a ring of so many metres and its running surface, a wave with 40 points; return it."""
    wires = "".join(_WIRE.replace("WIRE", name) for name in ("contact", "messenger"))
    path = folder / "rigid.toml"
    path.write_text(_LINE.replace("COUNT", str(spans)) + wires, encoding="utf-8")
    x = np.linspace(0.0, spans, round(40 * spans / wavelength) + 1)
    r = height * np.cos(2.0 * np.pi * x / wavelength)
    rows = "\n".join(f"{a:.9f},{1e3 * b:.12f}" for a, b in zip(x, r, strict=True))
    (folder / "wave.csv").write_text(f"position [m],height [mm]\n{rows}\n", encoding="utf-8")
    return path


def pressing(cx, **values):
    """Return CX at 300 km/h, raised at once, with force enough not to leave the wire."""
    own = {"static_force": 250.0, "raise_duration": 0.05, "speed": SPEED, "reference_height": 5.08}
    return cx.with_values(own | values)


def expected_amplitude(pantograph, wavelength, height):
    """Return a |Z| with 1/Z = 1/K + H(i 2 pi v / lambda) [N], H the receptance at the strip."""
    model, w = LumpedModel(pantograph), 2.0 * np.pi * SPEED / wavelength
    receptance = np.linalg.inv(model.K - w**2 * model.M + 1j * w * model.C)[-1, -1]
    return height / abs(1.0 / STIFFNESS + receptance)


def amplitude(force, step, wavelength, periods):
    """Return the amplitude of a force at the wave's frequency, over its last periods [N]."""
    turn = 2.0 * np.pi * SPEED / wavelength
    last = np.asarray(force)[-round(2.0 * np.pi * periods / turn / step) :]
    t = step * np.arange(len(last))
    columns = np.stack([np.ones_like(t), t, np.cos(turn * t), np.sin(turn * t)], axis=1)
    return float(np.hypot(*np.linalg.lstsq(columns, last, rcond=None)[0][2:]))
