"""A contact's law, and small dense systems, for numba: of one step of a line, and of steps side by side."""

from models.catenary.step.vector_kernels import part

#: Lowest impact velocity to which the damping of a contact refers [m/s].
SLOWEST_IMPACT = 1e-6


@part
def law_of(penetration, velocity, impact, engagement, contact):
    """Return the force of a contact and its slopes over penetration and velocity; see `models.contact_law`.

    Parameters
    ----------
    contact : ndarray or tuple
        Stiffness, exponent, restitution; whatever else.
    """
    if penetration <= 0.0:
        return 0.0, 0.0, 0.0
    if impact == 0.0:  # the first closed instant is its impact
        impact = max(velocity, 0.0)
    elastic = engagement * contact[0] * penetration ** contact[1]
    hysteresis = 0.75 * (1.0 - contact[2] ** 2) / max(impact, SLOWEST_IMPACT)
    factor = 1.0 + hysteresis * velocity
    if factor <= 0.0:
        return 0.0, 0.0, 0.0
    return elastic * factor, contact[1] * elastic / penetration * factor, elastic * hysteresis


@part
def eliminate(system, right, n):
    """Solve a dense system of n rows by elimination with row pivots, in place; return whether it is regular."""
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(system[i, k]) > abs(system[best, k]):
                best = i
        if system[best, k] == 0.0:
            return False
        if best != k:
            right[k], right[best] = right[best], right[k]
            for j in range(k, n):
                system[k, j], system[best, j] = system[best, j], system[k, j]
        for i in range(k + 1, n):
            share = system[i, k] / system[k, k]
            if share != 0.0:  # droppers far from each other
                right[i] -= share * right[k]
                for j in range(k + 1, n):
                    system[i, j] -= share * system[k, j]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            right[k] -= system[k, j] * right[j]
        right[k] /= system[k, k]
    return True
