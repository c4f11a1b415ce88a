"""Small FMUs in C such as others make, and SSPs around them: what the tests on foreign systems are run with."""

# ruff: noqa: E501 (C and XML, a thing a line)

from __future__ import annotations

import platform
import shutil
import subprocess
import zipfile
from collections.abc import Iterable
from pathlib import Path

import pytest

from master.errors import ScenarioError
from master.run_session import RunOptions, run
from master.scenario.open_scenario import open_scenario
from master.scenario.overrides import Overrides

SOURCE = r"""
#include <stdlib.h>
#include <string.h>
typedef unsigned int ref;
/* Real: u, k, y, x, t, tolerance, guess; Integer: i_in, i_out, e_in, e_out, i_set, count; Boolean; String. */
typedef struct { double r[8]; int i[6]; int b[2]; char s[2][256]; int runs; } M;
static void put(M *m) { /* between steps outputs stay what they were at the end of the last one */
    if (m->runs) return;
    m->r[2] = m->r[1] * m->r[0];
    m->i[1] = m->i[0] + m->i[4];
    m->i[3] = m->i[2];
    m->b[1] = !m->b[0];
    strcpy(m->s[1], m->s[0]);
}
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
int fmi2SetDebugLogging(void *c, int on, size_t n, const char *const k[]) { return 0; }
void *fmi2Instantiate(const char *n, int t, const char *g, const char *l, const void *f, int v, int o) {
    M *m = calloc(1, sizeof(M));
    m->r[0] = 0.5;
    m->r[1] = 1.0;
    m->i[2] = 1;
    put(m);
    return m;
}
void fmi2FreeInstance(void *c) { free(c); }
int fmi2SetupExperiment(void *c, int td, double tol, double t0, int sd, double t1) {
    M *m = c; m->r[4] = t0; m->r[5] = td ? tol : -1.0; return 0;
}
int fmi2EnterInitializationMode(void *c) { ((M *)c)->r[3] = ((M *)c)->r[6]; return 0; }
int fmi2ExitInitializationMode(void *c) { put(c); ((M *)c)->runs = 1; return 0; }
int fmi2Terminate(void *c) { return 0; }
int fmi2Reset(void *c) { return 0; }
#define GET(F, T, A) int F(void *c, const ref v[], size_t n, T w[]) { M *m = c; put(m); for (size_t i = 0; i < n; i++) w[i] = m->A[v[i]]; return 0; }
#define SET(F, T, A) int F(void *c, const ref v[], size_t n, const T w[]) { M *m = c; for (size_t i = 0; i < n; i++) m->A[v[i]] = w[i]; return 0; }
GET(fmi2GetReal, double, r) GET(fmi2GetInteger, int, i) GET(fmi2GetBoolean, int, b)
SET(fmi2SetReal, double, r) SET(fmi2SetInteger, int, i) SET(fmi2SetBoolean, int, b)
int fmi2GetString(void *c, const ref v[], size_t n, const char *w[]) { M *m = c; put(m); for (size_t i = 0; i < n; i++) w[i] = m->s[v[i]]; return 0; }
int fmi2SetString(void *c, const ref v[], size_t n, const char *const w[]) { M *m = c; for (size_t i = 0; i < n; i++) { strncpy(m->s[v[i]], w[i], 255); } return 0; }
int fmi2DoStep(void *c, double t, double h, int p) {
    M *m = c;
    m->r[3] += h * (m->r[0] - m->r[1] * m->r[3]);
    m->r[4] = t + h;
    m->i[5] += 1;
    m->runs = 0;
    put(m);
    m->runs = 1;
    return 0;
}
int fmi2GetFMUstate(void *c, void **s) { if (!*s) *s = malloc(sizeof(M)); memcpy(*s, c, sizeof(M)); return 0; }
int fmi2SetFMUstate(void *c, void *s) { memcpy(c, s, sizeof(M)); return 0; }
int fmi2FreeFMUstate(void *c, void **s) { free(*s); *s = 0; return 0; }
int fmi2SerializedFMUstateSize(void *c, void *s, size_t *n) { *n = sizeof(M); return 0; }
int fmi2SerializeFMUstate(void *c, void *s, char b[], size_t n) { memcpy(b, s, n); return 0; }
int fmi2DeSerializeFMUstate(void *c, const char b[], size_t n, void **s) { *s = malloc(n); memcpy(*s, b, n); return 0; }
int fmi2GetDirectionalDerivative(void *c, const ref u[], size_t nu, const ref k[], size_t nk, const double d[], double w[]) { return 3; }
int fmi2SetRealInputDerivatives(void *c, const ref v[], size_t n, const int o[], const double w[]) { return 3; }
int fmi2GetRealOutputDerivatives(void *c, const ref v[], size_t n, const int o[], double w[]) { return 3; }
int fmi2CancelStep(void *c) { return 3; }
int fmi2GetStatus(void *c, int k, int *w) { return 2; }
int fmi2GetRealStatus(void *c, int k, double *w) { return 2; }
int fmi2GetIntegerStatus(void *c, int k, int *w) { return 2; }
int fmi2GetBooleanStatus(void *c, int k, int *w) { return 2; }
int fmi2GetStringStatus(void *c, int k, const char **w) { return 2; }
"""

ITEMS = (("off", 1), ("low", 2), ("high", 3))


def description(
    units: tuple[str, str] = ("", ""),
    definitions: str = "",
    items: Iterable[tuple[str, int]] = ITEMS,
    tolerance: str = "",
) -> str:
    """The modelDescription.xml; ``units`` are those of u and y."""
    reported = [f' unit="{unit}"' if unit else "" for unit in units]
    rows = (
        ("u", 0, "input", "continuous", "", f'<Real start="0.5"{reported[0]}/>'),
        ("k", 1, "parameter", "fixed", "", '<Real start="1"/>'),
        ("y", 2, "output", "continuous", "", f"<Real{reported[1]}/>"),
        ("x", 3, "output", "continuous", "", "<Real/>"),
        ("t", 4, "output", "continuous", "", "<Real/>"),
        ("tolerance", 5, "output", "continuous", "", "<Real/>"),
        ("guess", 6, "local", "continuous", ' initial="exact"', '<Real start="0"/>'),
        ("i_in", 0, "input", "discrete", "", '<Integer start="0"/>'),
        ("i_out", 1, "output", "discrete", "", "<Integer/>"),
        ("e_in", 2, "input", "discrete", "", '<Enumeration declaredType="Speed" start="1"/>'),
        ("e_out", 3, "output", "discrete", "", '<Enumeration declaredType="Speed"/>'),
        ("i_set", 4, "parameter", "fixed", "", '<Integer start="0"/>'),
        ("count", 5, "output", "discrete", "", "<Integer/>"),
        ("b_in", 0, "input", "discrete", "", '<Boolean start="false"/>'),
        ("b_out", 1, "output", "discrete", "", "<Boolean/>"),
        ("s_in", 0, "input", "discrete", "", '<String start=""/>'),
        ("s_out", 1, "output", "discrete", "", "<String/>"),
    )
    variables = "".join(
        f'<ScalarVariable name="{n}" valueReference="{r}" causality="{c}" variability="{v}"{i}>{kind}</ScalarVariable>\n'
        for n, r, c, v, i, kind in rows
    )
    outputs = [i for i, row in enumerate(rows, start=1) if row[2] == "output"]
    unknown = "".join(f'<Unknown index="{i}"/>' for i in outputs)
    names = "".join(f'<Item name="{name}" value="{value}"/>' for name, value in items)
    defined = f"<UnitDefinitions>{definitions}</UnitDefinitions>" if definitions else ""
    experiment = (
        f'<DefaultExperiment startTime="0" stopTime="1"{tolerance and f" tolerance={chr(34)}{tolerance}{chr(34)}"}/>'
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="panel" guid="{{panel}}" generationTool="test">
<CoSimulation modelIdentifier="panel" canHandleVariableCommunicationStepSize="true" canGetAndSetFMUstate="true"
 canSerializeFMUstate="true"/>
{defined}
<TypeDefinitions><SimpleType name="Speed"><Enumeration>{names}</Enumeration></SimpleType></TypeDefinitions>
{experiment}
<ModelVariables>
{variables}</ModelVariables>
<ModelStructure><Outputs>{unknown}</Outputs><InitialUnknowns>{unknown}</InitialUnknowns></ModelStructure>
</fmiModelDescription>
"""


def compile_library(folder: Path, *changes: tuple[str, str]) -> Path:
    """Compile the FMUs' library, with other texts in places; skips the test where there is no compiler."""
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None or platform.system() != "Linux":
        pytest.skip("needs a C compiler on Linux")
    source, library = folder / "panel.c", folder / "panel.so"
    text = SOURCE
    for old, new in changes:
        assert old in text
        text = text.replace(old, new, 1)
    source.write_text(text)
    subprocess.run([compiler, "-shared", "-fPIC", "-O0", "-o", library, source], check=True, capture_output=True)
    return library


def write_fmu(path: Path, library: Path, text: str) -> Path:
    """Write an FMU."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("modelDescription.xml", text)
        file.write(library, "binaries/linux64/panel.so")
    return path


NAMESPACES = " ".join(
    f'xmlns:{prefix}="http://ssp-standard.org/SSP1/SystemStructure{name}"'
    for prefix, name in (
        ("ssc", "Common"), ("ssd", "Description"), ("ssv", "ParameterValues"), ("ssm", "ParameterMapping"),
    )
)  # fmt: skip
OSP = (
    '<ssd:Annotations><ssc:Annotation type="com.opensimulationplatform"><osp:Algorithm>'
    '<osp:FixedStepAlgorithm baseStepSize="0.1"/></osp:Algorithm></ssc:Annotation></ssd:Annotations>'
)


def connector(name: str, kind: str, what: str = "Real") -> str:
    """A connector; ``what`` is the element of its type with its attributes."""
    return f'<ssd:Connector name="{name}" kind="{kind}"><ssc:{what}/></ssd:Connector>'


def connectors(*reported: str) -> str:
    """Connectors."""
    return f"<ssd:Connectors>{''.join(reported)}</ssd:Connectors>" if reported else ""


def wire(start: str, end: str, inside: str = "", attributes: str = "") -> str:
    """A connection of ``element.connector`` or ``.connector``, which is the system's own."""
    (a, x), (b, y) = (place.split(".", 1) for place in (start, end))
    first = f'startElement="{a}" ' if a else ""
    second = f'endElement="{b}" ' if b else ""
    head = f'<ssd:Connection {first}startConnector="{x}" {second}endConnector="{y}"{attributes}'
    return f"{head}>{inside}</ssd:Connection>" if inside else f"{head}/>"


def component(name: str, *reported: str, source: str = "resources/panel.fmu", bindings: str = "") -> str:
    """A component with its connectors."""
    return f'<ssd:Component name="{name}" source="{source}">{connectors(*reported)}{bindings}</ssd:Component>'


def values(*pairs: tuple[str, str], units: str = "", prefix: str = "", mapping: str = "") -> str:
    """A binding of an inline set; pairs of names and typed values, e.g. ``Real value="1"``."""
    return (
        f"<ssd:ParameterBindings>{binding(*pairs, units=units, prefix=prefix, mapping=mapping)}</ssd:ParameterBindings>"
    )


def binding(*pairs: tuple[str, str], units: str = "", prefix: str = "", mapping: str = "") -> str:
    """One binding."""
    before = f' prefix="{prefix}"' if prefix else ""
    rows = parameters(*pairs)
    inline = f'<ssv:ParameterSet version="1.0" name="parameters">{rows}{units}</ssv:ParameterSet>'
    return f"<ssd:ParameterBinding{before}><ssd:ParameterValues>{inline}</ssd:ParameterValues>{mapping}</ssd:ParameterBinding>"


def parameters(*pairs: tuple[str, str]) -> str:
    """The parameters of a set."""
    rows = "".join(f'<ssv:Parameter name="{name}"><ssv:{value}/></ssv:Parameter>' for name, value in pairs)
    return f"<ssv:Parameters>{rows}</ssv:Parameters>"


def system(elements: str, wires: str = "", own: str = "", bindings: str = "", name: str = "whole") -> str:
    """A system."""
    joined = f"<ssd:Connections>{wires}</ssd:Connections>" if wires else ""
    return f'<ssd:System name="{name}">{own}{bindings}<ssd:Elements>{elements}</ssd:Elements>{joined}</ssd:System>'


def ssd(inside: str, rest: str = "", version: str = "1.0", stop: str = ' stopTime="1"') -> str:
    """A whole description; ``rest`` holds enumerations, units and annotations."""
    return (
        f'<?xml version="1.0" encoding="UTF-8"?>\n<ssd:SystemStructureDescription version="{version}" name="foreign" '
        f'{NAMESPACES} xmlns:osp="http://opensimulationplatform.com/SSP/OSPAnnotations">\n{inside}\n{rest}'
        f'<ssd:DefaultExperiment startTime="0"{stop}>{OSP}</ssd:DefaultExperiment>\n'
        "</ssd:SystemStructureDescription>\n"
    )


def opened(folder, **overrides):
    with open_scenario(folder, Overrides(**overrides), build=False) as found:
        return found.system


def problems(folder, **overrides):
    with pytest.raises(ScenarioError) as caught:
        opened(folder, **overrides)
    return [str(p) for p in caught.value.problems]


def ran(folder, tmp_path, options=None, **overrides):
    """The recording of a run, by name the values at all times."""
    with open_scenario(folder, Overrides(**overrides), build=False) as found:
        done = run(found.system, tmp_path / "out", options=options or RunOptions())
    recording = done.recordings[0]
    return {name: recording[name] for name in recording.names}
