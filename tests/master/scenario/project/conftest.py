"""FMUs of which only the description matters."""

import zipfile
from xml.sax.saxutils import quoteattr

import pytest


@pytest.fixture
def make_fmu(tmp_path):
    """Write an FMU that has real inputs, outputs and parameters of these names (name -> unit)."""

    def made(file, inputs=(), outputs=(), parameters=()):
        variables, units = [], set()
        for causality, names in (("input", inputs), ("output", outputs), ("parameter", parameters)):
            for name in names:
                unit = dict(names)[name] if isinstance(names, dict) else ""
                units.add(unit)
                kind = 'variability="tunable"' if causality == "parameter" else 'variability="continuous"'
                start = "" if causality == "output" else ' start="1.5"'
                declared = f" unit={quoteattr(unit)}" if unit else ""
                variables.append(
                    f'<ScalarVariable name={quoteattr(name)} valueReference="{len(variables)}" causality="{causality}" '
                    f"{kind}><Real{start}{declared}/></ScalarVariable>"
                )
        listed = "".join(f"<Unit name={quoteattr(u)}/>" for u in sorted(units) if u)
        outs = "".join(f'<Unknown index="{k + 1}"/>' for k, v in enumerate(variables) if 'causality="output"' in v)
        text = (
            '<?xml version="1.0" encoding="UTF-8"?><fmiModelDescription fmiVersion="2.0" modelName="x" guid="{1}">'
            '<CoSimulation modelIdentifier="x"/>'
            + (f"<UnitDefinitions>{listed}</UnitDefinitions>" if listed else "")
            + f"<ModelVariables>{''.join(variables)}</ModelVariables>"
            f"<ModelStructure>{f'<Outputs>{outs}</Outputs>' if outs else ''}</ModelStructure></fmiModelDescription>"
        )
        path = tmp_path / file
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", text)
        return path

    return made
