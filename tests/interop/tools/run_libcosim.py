"""Run a packed scenario in OSP's libcosim, which wants it unpacked; the files are those of the archive."""

import tempfile
import zipfile

import common
from libcosimpy.CosimExecution import CosimExecution
from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
from libcosimpy.CosimObserver import CosimObserver

archive, step, count, out = common.arguments()
log_output_level(CosimLogLevel.WARNING)
forces = []
with tempfile.TemporaryDirectory() as folder:
    zipfile.ZipFile(archive).extractall(folder)
    watch = common.Watch()
    # Without a step size given here, the step is the one in the archive's osp:FixedStepAlgorithm.
    execution = CosimExecution.from_ssp_file(folder)
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    slave = execution.slave_index_from_instance_name(common.COMPONENT)
    names = {v.name.decode(): v.reference for v in execution.slave_variables(slave)}
    reference = names[common.VARIABLE]
    watch.mark()
    for _ in range(count):
        if not execution.step():
            raise SystemExit("libcosim could not step")
        forces.append(float(observer.last_real_values(slave, [reference])[0]))
    watch.mark()
    reached = execution.status().current_time * 1e-9
    if abs(reached - count * step) > 1e-6:
        raise SystemExit(f"libcosim reached {reached} s instead of {count * step} s")
    common.write(out, step, forces)
    watch.report()
