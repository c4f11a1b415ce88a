"""A pantograph that is not ours, in plain pythonfmu: one mass, pressed up, with the ports that our lines talk to.

    pythonfmu build -f third_party_pantograph.py

docs/third-party-pantograph.md couples it to a line FMU by editing a scenario's SystemStructure.ssd.
"""

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real

PARAMETERS = {
    "speed": 83.0,  # m/s
    "start": 250.0,  # m
    "height": 5.02,  # m, below the wire
    "uplift": 155.0,  # N
    "mass": 18.0,  # kg
    "damping": 140.0,  # N.s/m, to the car's roof
    "strip_length": 1.2,  # m
}


class ThirdPartyPantograph(Fmi2Slave):
    """One mass on a damper, pressed up by a constant force."""

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.push = 0.0
        self.x = self.z = self.vz = 0.0
        for name, value in PARAMETERS.items():
            setattr(self, name, value)
            self.register_variable(
                Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable, start=value)
            )
        self.register_variable(Real("push", causality=Fmi2Causality.input, start=0.0))
        for end, side in (("left", 0.5), ("right", -0.5)):
            self._register_end(end, side)

    def _register_end(self, end, side):
        getters = {
            "x": lambda: self.x,
            "y": lambda: side * self.strip_length,
            "z": lambda: self.z,
            "vx": lambda: self.speed,
            "vy": lambda: 0.0,
            "vz": lambda: self.vz,
        }
        for name, getter in getters.items():
            self.register_variable(Real(f"{end}_{name}", causality=Fmi2Causality.output, getter=getter))

    def exit_initialization_mode(self):
        self.x, self.z = self.start, self.height

    def do_step(self, current_time, step_size):
        for _ in range(4):
            h = step_size / 4
            self.vz += (self.uplift - self.push - self.damping * self.vz) / self.mass * h
            self.z += self.vz * h
        self.x += self.speed * step_size
        return True
