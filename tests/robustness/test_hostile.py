"""Archives and documents that are made to do harm; and that nothing in the packages runs what it reads."""

from __future__ import annotations

import ast
import io
import stat
import struct
import zipfile
from pathlib import Path

import pytest

from fmus.__main__ import main as fmus
from master.commands.main import main
from master.errors import ScenarioError
from master.fmu.fmu_description import read_fmu
from master.ssp import archive
from master.ssp.archive import extract
from tests.master.conftest import SSV, ssd_text
from tests.robustness.support import TRIED, ask, assert_accepted, assert_refused, make_fmu, put_file

ROOT = Path(__file__).parents[2]
SSD = "SystemStructure.ssd"


def restore(scenario):
    put_file(scenario / SSD, ssd_text())
    put_file(scenario / "parameters.ssv", SSV)


def sound_members(scenario):
    restore(scenario)
    return [(p.relative_to(scenario).as_posix(), p.read_bytes()) for p in sorted(scenario.rglob("*")) if p.is_file()]


def pack(path, members):
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file, pytest.MonkeyPatch.context() as patch:
        patch.setattr("warnings.warn", lambda *_, **__: None)  # of names that are there twice
        for name, data in members:
            file.writestr(name, data)
    return path


def entry(name, mode=0o100644, flags=0):
    info = zipfile.ZipInfo(name)
    info.create_system, info.external_attr, info.flag_bits = 3, mode << 16, flags
    info.compress_type = zipfile.ZIP_DEFLATED
    return info


CLIMBING = ["../evil", "a/../../evil", "/tmp/evil", "//evil", "..", "C:evil", "C:\\evil", "..\\evil", "a\\..\\..\\evil",
            "./../evil", "resources/../../evil", "\\\\host\\evil", ".", "./", "/"]  # fmt: skip


@pytest.mark.parametrize("kind", ["ssp", "fmu"])
@pytest.mark.parametrize("name", CLIMBING)
def test_nothing_climbs_out(scenario, tmp_path, kind, name):
    answer, rule = asked(scenario, tmp_path, kind, [(entry(name), b"x")])
    assert_refused(answer, "would be written outside the folder")
    assert rule in answer.err
    assert not (tmp_path / "evil").exists()
    assert not Path("/tmp/evil").exists()


def asked(scenario, tmp_path, kind, more):
    """Ask for a sound scenario with further members in its archive, or in one of its FMUs'."""
    TRIED[f"hostile {kind}"] += 1
    if kind == "ssp":
        path = pack(tmp_path / "x.ssp", [*sound_members(scenario), *more])
        return ask(main, "validate", path, "--no-build"), "[archive"
    fmu = tmp_path / "ToyPantograph.fmu"
    with zipfile.ZipFile(scenario / "resources" / "ToyPantograph.fmu") as file:
        inside = [(n, file.read(n)) for n in file.namelist()]
    members = [(n, d) for n, d in sound_members(scenario) if "ToyPantograph" not in n]
    path = pack(
        tmp_path / "x.ssp", [*members, ("resources/ToyPantograph.fmu", pack(fmu, [*inside, *more]).read_bytes())]
    )
    return ask(main, "validate", path, "--no-build"), "ToyPantograph.fmu"


@pytest.mark.parametrize("kind", ["ssp", "fmu"])
@pytest.mark.parametrize(
    ("more", "said"),
    [
        ([(entry("link", stat.S_IFLNK | 0o777), "/etc/passwd")], "'link' is a symbolic link"),
        ([(entry("a"), b"1"), (entry("a"), b"2")], "'a' and 'a' would be written to the same place"),
        ([(entry("a"), b"1"), (entry("A"), b"2")], "'a' and 'A' would be written to the same place"),
        ([(entry("é"), b"1"), (entry("é"), b"2")], "would be written to the same place"),
        ([(entry("straße"), b"1"), (entry("STRASSE"), b"2")], "would be written to the same place"),
        ([(entry("b/./c"), b"1"), (entry("b/c"), b"2")], "would be written to the same place"),
        ([(entry("d"), b"1"), (entry("d/"), b"")], "would be written to the same place"),
        ([(entry("zeros"), bytes(40 * 1024**2))], "'zeros' would grow from"),
        ([(f"f{i}", b"") for i in range(10_001)], "files, more than 10000"),
    ],
    ids=["link", "twice", "case", "accent", "sharp s", "dot", "file and folder", "ratio", "count"],
)
def test_unsafe_members(scenario, tmp_path, kind, more, said):
    answer, rule = asked(scenario, tmp_path, kind, more)
    # Making forty megabytes of nothing took a while, refusing them does not.
    assert_refused(answer, said)
    assert rule in answer.err


@pytest.mark.parametrize("kind", ["ssp", "fmu"])
def test_more_of_the_same_is_no_harm(scenario, tmp_path, kind):
    more = [
        ("documentation/index.html", b"x"),
        ("documentation/Index.txt", b"x"),
        ("a..b", b""),
        (".x", b""),
        ("e/", b""),
    ]
    answer, _ = asked(scenario, tmp_path, kind, more)
    assert_accepted(answer, "x: valid")


def test_total_size(scenario, tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "MAX_BYTES", 10_000)
    for kind in ("ssp", "fmu"):
        answer, _ = asked(scenario, tmp_path, kind, [("x", bytes(10_001))])
        assert_refused(answer, "bytes, more than 10000")


def _patched(data, at, form, *values):
    changed = bytearray(data)
    struct.pack_into(form, changed, at, *values)
    return bytes(changed)


def test_a_size_that_is_a_lie(tmp_path):
    """What unpacks to more than it says ends with what it says, and with a wrong checksum."""
    path = pack(tmp_path / "x.ssp", [(SSD, bytes(100_000))])
    data = path.read_bytes()
    TRIED["hostile ssp"] += 1
    central = data.index(b"PK\x01\x02")
    put_file(path, _patched(_patched(data, central + 24, "<I", 10), 22, "<I", 10))
    (tmp_path / "out").mkdir()
    with pytest.raises(ScenarioError, match=r"not a readable \.ssp archive"):
        extract(path, tmp_path / "out")
    assert sum(p.stat().st_size for p in (tmp_path / "out").iterdir()) <= 10


@pytest.mark.parametrize("flags", [0x1, 0x40])
def test_encrypted_members(tmp_path, flags):
    path = pack(tmp_path / "x.ssp", [(SSD, b"x")])
    data = path.read_bytes()
    TRIED["hostile ssp"] += 1
    central = data.index(b"PK\x01\x02")
    put_file(path, _patched(_patched(data, central + 8, "<H", flags), 6, "<H", flags))
    assert_refused(ask(main, "validate", path), "x.ssp")


@pytest.mark.parametrize("method", [1, 6, 9, 12, 14, 93, 99, 0xFFFF])
def test_members_packed_in_other_ways(tmp_path, method):
    path = pack(tmp_path / "x.ssp", [(SSD, b"x" * 100)])
    data = path.read_bytes()
    TRIED["hostile ssp"] += 1
    central = data.index(b"PK\x01\x02")
    put_file(path, _patched(_patched(data, central + 10, "<H", method), 8, "<H", method))
    assert_refused(ask(main, "validate", path), "is not a readable .ssp archive")


def test_an_archive_in_an_archive_is_no_component(scenario, tmp_path):
    """SSP allows packages as components; they are refused, and not opened."""
    members = dict(sound_members(scenario))
    inner = pack(tmp_path / "inner.ssp", list(members.items()))
    text = ssd_text().replace(
        'source="resources/ToyCatenary.fmu"', 'source="inner.ssp" type="application/x-ssp-package"'
    )
    path = pack(tmp_path / "x.ssp", [*{**members, SSD: text.encode(), "inner.ssp": inner.read_bytes()}.items()])
    TRIED["hostile ssp"] += 1
    assert_refused(ask(main, "validate", path, "--no-build"), "only FMUs")


SECRET = "the treasure is in the cellar"


def bombs(secret):
    many = " ".join(f'a{i}="{i}"' for i in range(20_000))
    laughs = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 12))
    return {
        "external": f'<!DOCTYPE x [<!ENTITY s SYSTEM "file://{secret}">]><x a="1">&s;</x>',
        "parameter entity": f'<!DOCTYPE x [<!ENTITY % s SYSTEM "file://{secret}"> %s;]><x/>',
        "external dtd": f'<!DOCTYPE x SYSTEM "file://{secret}"><x/>',
        "network": '<!DOCTYPE x SYSTEM "http://127.0.0.1:9/x.dtd"><x/>',
        "laughs": f'<!DOCTYPE x [<!ENTITY a0 "ha">{laughs}]><x>&a11;</x>',
        "quadratic": f'<!DOCTYPE x [<!ENTITY a "{"A" * 50_000}">]><x>{"&a;" * 50_000}</x>',
        "default attribute": '<!DOCTYPE x [<!ATTLIST x a CDATA "1">]><x/>',
        "empty doctype": "<!DOCTYPE x><x/>",
        "deep": "<x>" * 100_000,
        "deep and closed": "<x>" * 100_000 + "</x>" * 100_000,
        "huge attribute": f'<x a="{"A" * 20_000_000}"/>',
        "huge text": f"<x>{'A' * 20_000_000}</x>",
        "many attributes": f"<x {many}/>",
        "many namespaces": f"<x {many.replace('a', 'xmlns:a')}/>",
        "schema location": '<x xmlns:i="http://www.w3.org/2001/XMLSchema-instance" i:schemaLocation="x file:///etc"/>',
        "inclusion": f'<x xmlns:i="http://www.w3.org/2001/XInclude"><i:include href="{secret}" parse="text"/></x>',
        "style sheet": f'<?xml-stylesheet href="file://{secret}"?><x/>',
    }


KINDS = tuple(bombs(""))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("place", [SSD, "parameters.ssv", "m.ssm", "fmu"])
def test_documents_made_to_do_harm(scenario, tmp_path, kind, place):
    TRIED["hostile document"] += 1
    secret = tmp_path / "secret"
    put_file(secret, SECRET)
    members = dict(sound_members(scenario))
    text = bombs(secret)[kind]
    if place == "fmu":
        buffer = io.BytesIO()
        with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as file:
            file.writestr("modelDescription.xml", text)
        members["resources/ToyPantograph.fmu"] = buffer.getvalue()
    else:
        members[place] = text.encode()
    if place == "m.ssm":
        binding = '<ssd:ParameterBinding source="parameters.ssv"'
        mapped = f'{binding}><ssd:ParameterMapping source="m.ssm"/></ssd:ParameterBinding>'
        members[SSD] = ssd_text().replace(f"{binding}/>", mapped).encode()
    folder = tmp_path / "x.ssp"
    for name, data in members.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        put_file(folder / name, data)
    answer = ask(main, "validate", folder, "--no-build")
    assert_refused(answer, "ToyPantograph.fmu" if place == "fmu" else f"{place}:")
    assert SECRET not in answer.err


def test_an_entity_inside_a_sound_document(scenario, tmp_path):
    """Even harmless entities are refused: what a document says must stand in it."""
    restore(scenario)
    for before in ("<!DOCTYPE x [<!ENTITY f '140'>]>", "<!DOCTYPE ssv:ParameterSet>"):
        TRIED["hostile document"] += 1
        head, _, rest = SSV.partition("?>")
        text = f"{head}?>{before}{rest}".replace('value="140"', 'value="&f;"' if "f '" in before else 'value="140"')
        put_file(scenario / "parameters.ssv", text)
        answer = ask(main, "validate", scenario, "--no-build")
        assert_refused(answer, "a document type declaration is not allowed")
    restore(scenario)


SOURCES = ["../x.fmu", "/etc/passwd", "file:///etc/passwd", "http://127.0.0.1:9/x.fmu", "..\\x.fmu", "a" * 300,
    "a/" * 3000,
           "", ".", "resources", "resources/", "C:/x.fmu", "//host/x.fmu", "\u202efmu.x",
           "resources/%2e%2e/x.fmu"]  # fmt: skip


@pytest.mark.parametrize("source", SOURCES, ids=range(len(SOURCES)))
@pytest.mark.parametrize("what", ["component", "parameters", "mapping"])
def test_sources_outside_the_scenario(scenario, source, what):
    TRIED["hostile source"] += 1
    binding = '<ssd:ParameterBinding source="parameters.ssv"/>'
    old, new = {
        "component": ("resources/ToyPantograph.fmu", source),
        "parameters": ('source="parameters.ssv"', f'source="{source}"'),
        "mapping": (binding, f'{binding[:-2]}><ssd:ParameterMapping source="{source}"/></ssd:ParameterBinding>'),
    }[what]
    restore(scenario)
    put_file(scenario / SSD, ssd_text().replace(old, new))
    answer = ask(main, "validate", scenario, "--no-build")
    assert_refused(answer, f"{SSD}:")
    assert "root:" not in answer.err
    restore(scenario)


@pytest.mark.parametrize("target", ["/etc/passwd", "../../outside", "circle"])
def test_links_in_a_folder(scenario, tmp_path, target):
    TRIED["hostile source"] += 1
    folder = tmp_path / "x.ssp"
    for name, data in sound_members(scenario):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        put_file(folder / name, data)
    (folder / "parameters.ssv").unlink()
    (folder / "circle").symlink_to("circle")
    (folder / "parameters.ssv").symlink_to(target)
    assert_refused(ask(main, "validate", folder, "--no-build"), f"{SSD}:", "parameters.ssv")


BAD_FMUS = {
    "identifier": ('modelIdentifier="X"', 'modelIdentifier="../../X"', "cannot be the name of a library"),
    "no identifier": ('modelIdentifier="X"', "", "ToyPantograph.fmu"),
    "version": ('fmiVersion="2.0"', 'fmiVersion="3.0"', "FMU"),
    "no version": ('fmiVersion="2.0"', "", "FMU"),
    "exchange": ("<CoSimulation", "<ModelExchange", "co-simulation"),
    "reference": ('valueReference="0"', 'valueReference="-1"', "cannot be addressed"),
    "huge reference": ('valueReference="0"', 'valueReference="' + "9" * 5000 + '"', "cannot be addressed"),
    "no reference": ('valueReference="0"', "", "cannot be addressed"),
    "no name": ('name="A.x"', "", "cannot be addressed"),
    "twice": ('name="A.x"', 'name="A.y"', "declares the variable 'A.y' twice"),
    "limit": ("<Real ", '<Real min="low" ', "declares min='low'"),
    "nan limit": ("<Real ", '<Real max="NaN" ', "declares max='NaN'"),
}


@pytest.mark.parametrize("kind", BAD_FMUS)
def test_descriptions_of_fmus_that_cannot_be(scenario, tmp_path, kind):
    TRIED["FMU, by hand"] += 1
    old, new, said = BAD_FMUS[kind]
    path = make_fmu(tmp_path / "X.fmu", [("A.x", "output", "m"), ("A.y", "output", "m")])
    with zipfile.ZipFile(path) as file:
        text = file.read("modelDescription.xml").decode()
    assert old in text
    members = dict(sound_members(scenario))
    members["resources/ToyPantograph.fmu"] = pack(
        path, [("modelDescription.xml", text.replace(old, new, 1))]
    ).read_bytes()
    answer = ask(main, "validate", pack(tmp_path / "x.ssp", list(members.items())), "--no-build")
    assert_refused(answer, "ToyPantograph.fmu", said)


@pytest.mark.parametrize(
    "data", [b"", b"PK\x05\x06" + bytes(18), b"PK\x03\x04", b"\x00" * 100, b"<xml/>"], ids=range(5)
)
def test_files_that_are_no_fmu(tmp_path, data):
    TRIED["FMU, by hand"] += 1
    path = tmp_path / "x.fmu"
    put_file(path, data)
    with pytest.raises(ValueError, match="is not a readable FMU"):
        read_fmu(path)
    answer = ask(fmus, "doctor", path)
    assert answer.code == 1
    assert "is not an FMU of this kind" in answer.out


#: Calls that run what they are given, or let what they read choose what is run.
DANGEROUS = {"eval", "exec", "compile", "__import__"}
DANGEROUS_MODULES = {"pickle", "cPickle", "dill", "cloudpickle", "shelve", "marshal", "joblib", "yaml", "jsonpickle"}
DANGEROUS_ATTRIBUTES = {("np", "load"), ("numpy", "load"), ("os", "system"), ("os", "popen"), ("torch", "load")}
#: What is looked at before it is read: numba keeps machine code as pickles. Owner, rights and checksum of a file come
#: first (`tests/models/numerics/test_kernel_cache.py`, `tests/robustness/test_caches.py`).
#: What Python compiled of an FMU's sources is kept there too, under the same rules (`models/numerics/user_cache.py`).
#: A runtime compiles modules of the Python, numpy and scipy that it is made of, which the builder runs anyway.
GUARDED = {
    "models/numerics/kernel_cache.py": ["pickle"],
    "fmus/slave/kept_code.py": ["marshal"],
    "fmus/loader/runtime.py": ["marshal", "compile"],
    # Over pipes between a command and the process that it has started itself; no file is read so.
    "master/batch/sweep/child_engine.py": ["pickle"],
    "master/batch/sweep/run_child.py": ["pickle"],
}
SOURCES_OF_THE_PACKAGES = [
    p for package in ("models", "fmus", "master") for p in sorted((ROOT / package).rglob("*.py"))
]


def dangers(tree):
    """Yield what a program does that would make reading a file the same as running it."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (a.name for a in node.names if a.name.partition(".")[0] in DANGEROUS_MODULES)
        elif isinstance(node, ast.ImportFrom) and (node.module or "").partition(".")[0] in DANGEROUS_MODULES:
            yield node.module
        elif isinstance(node, ast.Call):
            yield from _dangerous_call(node)


def _dangerous_call(node):
    function = node.func
    if isinstance(function, ast.Name) and function.id in DANGEROUS:
        yield function.id
    if isinstance(function, ast.Attribute) and isinstance(function.value, ast.Name):
        name = (function.value.id, function.attr)
        allowed = name[0] in ("np", "numpy") and not any(k.arg == "allow_pickle" for k in node.keywords)
        if name in DANGEROUS_ATTRIBUTES and not allowed:
            yield ".".join(name)
    for keyword in node.keywords:
        is_true = isinstance(keyword.value, ast.Constant) and keyword.value.value is True
        if keyword.arg in ("shell", "allow_pickle") and is_true:
            yield f"{keyword.arg}=True"


@pytest.mark.parametrize("path", SOURCES_OF_THE_PACKAGES, ids=lambda p: str(p.relative_to(ROOT)))
def test_nothing_that_is_read_is_run(path):
    guarded = GUARDED.get(path.relative_to(ROOT).as_posix(), [])
    assert list(dangers(ast.parse(path.read_text(encoding="utf-8")))) == guarded


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("import pickle", "pickle"),
        ("from marshal import loads", "marshal"),
        ("import yaml as y", "yaml"),
        ("eval('1')", "eval"),
        ("exec(x)", "exec"),
        ("__import__('os')", "__import__"),
        ("os.system('x')", "os.system"),
        ("np.load(x, allow_pickle=True)", "np.load"),
        ("subprocess.run(x, shell=True)", "shell=True"),
    ],
)
def test_the_check_would_find_it(text, found):
    assert found in list(dangers(ast.parse(text)))
