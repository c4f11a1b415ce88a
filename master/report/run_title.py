"""What a run is called in its report: as its scenario says, and how its train moved if that changed on the way."""

from __future__ import annotations

import re
from typing import Final

import numpy as np

from master.evaluation.contact_positions import running_position
from master.results.run_results import Results

#: What `openpanto new` writes of a speed at the end of a title.
_WRITTEN: Final = re.compile(r" at [\d.]+ km/h$")
#: Time over which a speed is taken from positions [s], and the share by which it must change to be told.
_WINDOW: Final = 0.1
_CHANGES: Final = 0.01
_KMH: Final = 3.6


def run_title(done: Results) -> str:
    """Return the scenario's title, empty if it has none; of a train whose speed changed, with the lowest and highest.

    The speed of a title that `openpanto new` has written is that of the project as it was made, and is left out then.
    """
    title, moved = str(done.summary.get("title") or ""), changing_speed(done)
    return f"{_WRITTEN.sub('', title)}, {moved}" if title and moved else title


def changing_speed(done: Results) -> str:
    """Say between which speeds trains ran, empty if each kept its own."""
    found = []
    for recording in done.recordings[:1]:
        for contact in done.contacts:
            if contact.force not in recording or len(recording.time) < 3:
                continue
            time, x = recording.time, running_position(recording, contact)
            stride = max(1, min(len(time) // 2, round(_WINDOW / max(float(np.median(np.diff(time))), 1e-9))))
            speed = np.abs((x[stride:] - x[:-stride]) / (time[stride:] - time[:-stride])) * _KMH
            found.append((float(speed.min()), float(speed.max())))
    if not any(high - low > _CHANGES * high for low, high in found):
        return ""
    low, high = min(f[0] for f in found), max(f[1] for f in found)
    return f"{_how(done)}, {low:.0f} to {high:.0f} km/h"


def _how(done: Results) -> str:
    """Return what made the speed change: a pantograph with a speed profile has no parameter ``speed``."""
    contacts = {c.pantograph for c in done.contacts}
    inputs = [
        {i.get("name"): i.get("value") for i in c.get("inputs", [])}
        for c in done.summary.get("components", [])
        if c.get("name") in contacts
    ]
    if any(float(i.get("use_train") or 0.0) for i in inputs):
        return "speed as inputs say"
    return "speed profile" if inputs and all("speed" not in i for i in inputs) else "changing speed"
