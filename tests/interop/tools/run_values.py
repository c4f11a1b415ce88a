"""Run a packed scenario in a tool and read any numbers: ``python run_values.py TOOL ARCHIVE STEP COUNT OUT NAME ...``.

Names are ``component::variable::type``; a row of values for every step goes to OUT.
"""

import sys
import tempfile
import zipfile
from pathlib import Path

tool, archive, step, count, out, *names = sys.argv[1:]
wanted = [tuple(name.split("::")) for name in names]
rows = []


def run_ecos():
    from ecospy import EcosLib, EcosSimulation

    EcosLib.set_log_level("warn")
    with EcosSimulation(ssp_path=archive, step_size=float(step)) as simulation:
        simulation.init(parameter_set="parameters")
        get = {"Real": simulation.get_real, "Integer": simulation.get_integer, "Boolean": simulation.get_bool}
        for _ in range(int(count)):
            simulation.step()
            rows.append([float(get[kind](f"{component}::{name}")) for component, name, kind in wanted])


def run_libcosim():
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimObserver import CosimObserver

    log_output_level(CosimLogLevel.WARNING)
    with tempfile.TemporaryDirectory() as folder:
        zipfile.ZipFile(archive).extractall(folder)
        execution = CosimExecution.from_ssp_file(folder)
        observer = CosimObserver.create_last_value()
        execution.add_observer(observer)
        get = {
            "Real": observer.last_real_values,
            "Integer": observer.last_integer_values,
            "Boolean": observer.last_boolean_values,
        }
        places = []
        for component, name, kind in wanted:
            slave = execution.slave_index_from_instance_name(component)
            found = [v for v in execution.slave_variables(slave) if v.name.decode() == name]
            places.append((get[kind], slave, found[0].reference))
        for _ in range(int(count)):
            if not execution.step():
                raise SystemExit("libcosim could not step")
            rows.append([float(read(slave, [reference])[0]) for read, slave, reference in places])


{"ecos": run_ecos, "libcosim": run_libcosim}[tool]()
Path(out).write_text("".join(",".join(map(repr, row)) + "\n" for row in rows), encoding="utf-8")
