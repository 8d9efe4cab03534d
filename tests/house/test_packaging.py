"""The conda recipe and the Dockerfile, held to what pyproject.toml and the repository say; neither is built here."""

import re
import tomllib
from pathlib import Path

import yaml
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[2]
PACKAGING = ROOT / "scripts" / "packaging"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
OF_CONDA = {"matplotlib": "matplotlib-base"}  # where conda-forge has another name
OF_EXTRAS = {"h5netcdf", "xarray", "xarray-einstats"}  # conda has no extras


def test_the_conda_recipe_asks_for_what_the_project_does():
    recipe = yaml.safe_load((PACKAGING / "conda" / "meta.yaml").read_text())
    assert (recipe["package"]["name"], recipe["package"]["version"]) == (PROJECT["name"], PROJECT["version"])
    assert recipe["build"]["entry_points"] == [f"{name} = {target}" for name, target in PROJECT["scripts"].items()]
    assert (recipe["about"]["license"], recipe["source"]["path"]) == (PROJECT["license"], "../../..")
    stated_value = dict(line.partition(" ")[::2] for line in recipe["requirements"]["run"])
    assert stated_value.pop("python") == PROJECT["requires-python"]
    assert {stated_value.pop(name) for name in OF_EXTRAS} == {""}
    wanted = [Requirement(text) for text in PROJECT["dependencies"]]
    names = [canonicalize_name(requirement.name) for requirement in wanted]
    assert stated_value == {
        OF_CONDA.get(name, name): str(requirement.specifier) for name, requirement in zip(names, wanted, strict=True)
    }


def test_the_image_copies_what_is_there_and_runs_without_root():
    text = (PACKAGING / "Dockerfile").read_text()
    copied = [source for line in re.findall(r"^COPY (?!--from)(.*)$", text, re.MULTILINE) for source in line.split()[:-1]]
    assert {"pyproject.toml", "constraints.txt", "bowdenfit"} < set(copied)
    assert all((ROOT / source).exists() for source in copied)
    let_in = {line[1:] for line in (PACKAGING / "Dockerfile.dockerignore").read_text().splitlines() if line.startswith("!")}
    assert let_in == set(copied)
    bases = set(re.findall(r"^FROM python:([\d.]+)-slim", text, re.MULTILINE))
    assert len(bases) == 1 and SpecifierSet(PROJECT["requires-python"]).contains(bases.pop())
    lines = text.splitlines()
    users = [line.removeprefix("USER ") for line in lines if line.startswith("USER ")]
    assert users and "root" not in users and lines.index(f"USER {users[-1]}") < lines.index('ENTRYPOINT ["bowdenfit"]')
    assert all("constraint" in line.lower() for line in lines if "pip install" in line or "pip wheel" in line)
