"""Whether an FMU's code can be loaded, and why not: run in the FMU's Python before pythonfmu is used.

The loader carries this text. pythonfmu's library does not survive code that cannot be imported or compiled, or a path
that Python takes for another one; so such an FMU never reaches it. Old Pythons must understand this file.
"""

import importlib
import importlib.machinery
import os
import sys


def problem(resources: str, script: str) -> str:
    """Return why ``script`` in the folder cannot be loaded, in words; empty if it can, "alias" for another path."""
    if sys.version_info < (3, 11):
        return "Python in this process is %d.%d, but 3.11 or newer is needed" % sys.version_info[:2]
    try:
        if os.fsencode(resources) != resources.encode("utf-8"):
            return "alias"
    except UnicodeError:
        return "alias"
    path = os.path.join(resources, script + ".py")
    sys.path.insert(0, resources)
    try:
        importlib.import_module(script)
        with open(path, "rb") as file:
            # What was imported may be an earlier instance's; pythonfmu reads this file, and ends Python if it is none.
            importlib.machinery.SourceFileLoader(script, path).source_to_code(file.read(), path)
    except ModuleNotFoundError as error:
        name = str(error.name).partition(".")[0]
        if name.startswith(("openpanto_", script)):
            return "the FMU is incomplete: " + str(error) + "; unpack it again, or rebuild it"
        return "the Python in this process (" + _place() + ") lacks the package " + name + "; install it there"
    except BaseException as error:
        return "the FMU cannot be loaded: " + (str(error) or type(error).__name__)
    finally:
        forget(resources)
    return ""


def forget(resources: str, _: str = "") -> None:
    """Take the folder out of the places that modules come from; all that is needed has been imported."""
    try:
        while True:
            sys.path.remove(resources)  # atomic: another thread may be adding the folder of its FMU
    except ValueError:
        pass


def set_paths(places: str, content: str) -> None:
    """Let modules come from these places alone, the parts of a runtime that came with an FMU."""
    sys.path[:] = places.split("\n")
    setattr(sys, "openpanto_runtime", content)  # noqa: B010 - for another FMU that brings a runtime


def other_versions(wanted: str, content: str) -> str:
    """Return a sentence if the Python that an FMU brought has other versions than the one that it runs in."""
    if getattr(sys, "openpanto_runtime", "") == content:
        return ""
    found = ["%d.%d.%d" % sys.version_info[:3]]
    found += [str(getattr(sys.modules.get(name), "__version__", "")) for name in ("numpy", "scipy")]
    rows = zip(("Python", "numpy", "scipy"), wanted.split(), found)  # noqa: B905 - not known to old Pythons
    pairs = [(name, own, there) for name, own, there in rows if there and own != there]
    if not pairs:
        return ""
    brought = ", ".join(name + " " + own for name, own, _ in pairs)
    used = ", ".join(name + " " + there for name, _, there in pairs)
    return "the FMU brought " + brought + ", but runs with " + used + ", which was in this process first"


def _place() -> str:
    return sys.executable or sys.prefix
