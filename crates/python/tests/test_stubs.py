"""The typed stubs match the modules in names and parameters, and everything has a docstring."""

import ast
import importlib
import inspect
from pathlib import Path

import pytest

import hwall

STUBS = Path(hwall.__file__).parent


def public(names):
    return {name for name in names if not name.startswith("_")}


@pytest.mark.parametrize("module", ["__init__", "bip", "contact", "sim", "texton"])
def test_stubs_and_modules_have_the_same_names(module):
    there = hwall if module == "__init__" else importlib.import_module(f"hwall.{module}")
    stub = ast.parse((STUBS / f"{module}.pyi").read_text())
    told = {node.name: node for node in stub.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    modules = {"bip", "contact", "sim", "texton"} if module == "__init__" else set()
    assert set(told) | modules == set(there.__all__)
    for name, node in told.items():
        found = getattr(there, name)
        assert found.__doc__, name
        if isinstance(node, ast.FunctionDef):
            check_parameters(found, node)
        elif name != "Error":
            members = {member.name: member for member in node.body if isinstance(member, ast.FunctionDef)}
            fields = {member.target.id for member in node.body if isinstance(member, ast.AnnAssign)}
            assert public(members) | fields == public(vars(found)), name
            for member in public(members):
                assert getattr(found, member).__doc__, f"{name}.{member}"
                if callable(getattr(found, member)):
                    check_parameters(getattr(found, member), members[member])
            if "__new__" in members:
                check_parameters(found, members["__new__"])


def check_parameters(function, node):
    told = [argument.arg for argument in node.args.args + node.args.kwonlyargs if argument.arg not in ("self", "cls")]
    told += [node.args.kwarg.arg] if node.args.kwarg else []
    there = [name for name in inspect.signature(function).parameters if name != "self"]
    assert told == there, function
