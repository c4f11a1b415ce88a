"""What the Python that an FMU would run in has: one answer per line, after a line that marks where they begin.

The loader carries this text. Python 3.8 must understand it.
"""

import importlib.util
import os
import sys
import sysconfig

var = sysconfig.get_config_var
version = "%d.%d" % sys.version_info[:2]
names = [var("INSTSONAME"), var("LDLIBRARY"), "libpython" + version + ".so.1.0", "libpython" + version + ".dylib"]
folders = [var("LIBDIR"), var("LIBPL"), os.path.join(sys.base_prefix, "lib")]
folders += [os.path.join(f, var("MULTIARCH")) for f in folders if f and var("MULTIARCH")]
places = [os.path.join(f, n) for f in folders if f for n in names if n and (".so" in n or ".dylib" in n)]
missing = [m for m in ("numpy", "scipy") if importlib.util.find_spec(m) is None]
print("openpanto_probe:")
print(sys.executable)
print(version)
print(next((p for p in places if os.path.isfile(p)), ""))
if sys.version_info < (3, 11):
    print("is Python " + version + ", but 3.11 or newer is needed")
elif missing:
    print("lacks the packages " + " and ".join(missing))
else:
    print("")
