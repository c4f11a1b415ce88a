"""The model description says what the FMU is, and other tools accept it."""

from __future__ import annotations

import math
import zipfile
from xml.etree import ElementTree as ET

import fmpy
import pytest
from fmpy.validation import validate_fmu

from fmus.slave.model_description import base_unit
from models.definition_files.si_units import SI


@pytest.fixture(scope="module")
def description(toy_fmu):
    return fmpy.read_model_description(str(toy_fmu))


@pytest.fixture(scope="module")
def variables(description):
    return {v.name: v for v in description.modelVariables}


def test_fmpy_finds_no_problems(toy_fmu):
    assert validate_fmu(str(toy_fmu)) == []


def test_every_real_has_a_defined_unit(description):
    defined = {u.name for u in description.unitDefinitions}
    reals = [v for v in description.modelVariables if v.type == "Real"]
    assert reals
    assert {v.unit for v in reals} == defined


@pytest.mark.parametrize("unit", sorted({si for si, _ in SI.values()}))
def test_every_unit_of_the_models_has_base_units(unit):
    assert set(base_unit(unit)) <= {"kg", "m", "s", "rad", "K"}


def test_base_units_are_those_of_physics():
    assert base_unit("N.m.s/rad") == {"kg": 1, "m": 2, "s": -1, "rad": -1}
    assert base_unit("1/s") == base_unit("Hz") == {"s": -1}
    assert base_unit("N/m") == {"kg": 1, "s": -2}
    assert base_unit("m4") == {"m": 4}
    assert base_unit("1") == {}
    with pytest.raises(ValueError, match="furlong"):
        base_unit("N/furlong")


def test_start_values_are_read_back_exactly(variables):
    assert float(variables["stiffness"].start) == 100.12345678901234
    assert variables["stiffness"].start == "100.12345678901234"


def test_parameters_carry_range_source_and_type(variables):
    assert (variables["stiffness"].min, variables["stiffness"].max) == ("1.0", "1000000.0")
    assert variables["stiffness"].description == "stiffness [Table 1, 5 % quantile]"
    assert variables["substeps"].type == "Integer"
    assert (variables["substeps"].start, variables["substeps"].min) == ("3", "1")


def test_causality_and_variability(variables):
    kinds = {n: (v.causality, v.variability, v.initial) for n, v in variables.items()}
    assert kinds["mass"] == ("parameter", "fixed", "exact")
    assert kinds["force"] == ("input", "continuous", "exact")
    assert kinds["mass[1].z"] == ("output", "continuous", "calculated")
    assert kinds["spring[1].force"] == ("local", "continuous", "calculated")
    assert kinds["rest"] == ("calculatedParameter", "fixed", "calculated")


def test_capabilities_are_those_that_there_are(description):
    can = description.coSimulation
    assert can.canGetAndSetFMUstate
    assert can.canSerializeFMUstate
    assert can.canHandleVariableCommunicationStepSize
    assert not can.canInterpolateInputs
    assert not can.canBeInstantiatedOnlyOncePerProcess


def test_outputs_have_no_direct_feedthrough_and_all_are_initial_unknowns(description):
    assert [u.variable.name for u in description.outputs] == ["mass[1].z", "mass[2].z"]
    assert all(u.dependencies == [] for u in description.outputs)
    assert {u.variable.name for u in description.initialUnknowns} == {"mass[1].z", "mass[2].z", "rest"}


def test_default_experiment_and_identity(description, toy_fmu):
    assert math.isclose(float(description.defaultExperiment.stepSize), 1e-3)
    assert float(description.defaultExperiment.stopTime) == 1.0
    assert float(description.defaultExperiment.tolerance) == 1e-6
    with zipfile.ZipFile(toy_fmu) as archive:
        root = ET.fromstring(archive.read("modelDescription.xml"))
        script = archive.read("resources/slavemodule.txt").decode()
    assert root.get("guid") == description.guid
    assert script == f"Toy_{description.guid.replace('-', '')[:12]}"
