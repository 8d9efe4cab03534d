"""Before a fit starts: may the results folder be written, which seed, which checkpoint."""

import secrets
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bowdenfit.arguments import LARGEST_SEED
from bowdenfit.dataset import Dataset
from bowdenfit.description import SamplerSettings
from bowdenfit.errors import DescriptionError, StoreError, UsageError
from bowdenfit.inference.checkpoint import checkpoint_header, damaged_checkpoint_error, read_fingerprint
from bowdenfit.kinds.descriptions import parse_description
from bowdenfit.outputs import replace_atomically
from bowdenfit.results.folder import (
    CHAIN,
    FIT,
    folder_to_write,
    refuse_invalid_seed,
    refuse_to_overwrite,
    remove_earlier_fit,
    remove_partial,
)


def choose_sampler(data: Dataset, method: str | None, mcmc: bool) -> Dataset:
    """Return the data set with another sampler than its description names; unchanged if `method` is None.

    Raises:
        UsageError: Nothing is sampled, or the sampler cannot reach what is asked of it.
    """
    if method is not None and not mcmc:
        raise UsageError("--no-mcmc leaves out what --sampler would do; leave one of them out.")
    changed = _with_method(data, method)
    _refuse_out_of_reach(changed.description.sampler)
    return changed


def _refuse_out_of_reach(settings: SamplerSettings) -> None:
    """Refuse a target that sampling would miss at its last step, however well it goes."""
    if settings.target_ess > settings.most_draws:
        raise UsageError(
            f"sampler.target_ess asks for {settings.target_ess:,} effective draws, but after sampler.max_steps = "
            f"{settings.max_steps:,} steps there are {settings.most_draws:,} draws at most; ask for fewer, or allow more steps."
        )


def _with_method(data: Dataset, method: str | None) -> Dataset:
    if method is None:
        return data
    sampler = data.description.sampler.model_copy(update={"method": method})
    return replace(data, description=data.description.model_copy(update={"sampler": sampler}))


def _fingerprint(data: Dataset, seed: int) -> dict[str, Any]:
    """Return what must not change between an interrupted fit and its continuation; how long to sample may."""
    return {"description": _for_good(data.description.to_json()), "sha256": data.sha256, "seed": seed}


def _for_good(description: dict[str, Any]) -> dict[str, Any]:
    """Return a description without what may change."""
    free = {"max_steps", "target_r_hat", "target_ess"}
    return description | {"sampler": {k: v for k, v in description["sampler"].items() if k not in free}}


def _with_defaults(description: dict[str, Any]) -> dict[str, Any]:
    """Return a checkpoint's description with newer settings at their defaults."""
    try:
        return _for_good(parse_description(description).to_json())
    except DescriptionError:
        return description


def choose_seed(folder: Path | None, data: Dataset, mcmc: bool, seed: int | None, resume: bool, force: bool) -> int:
    """Return the seed, after checking that the folder may be written or that its checkpoint belongs to this fit."""
    if resume and (folder is None or not mcmc):
        raise UsageError("--resume needs the results folder of a fit with MCMC; name it with --output.")
    if folder is None or not resume:
        if folder is not None:
            refuse_to_overwrite(folder, force)
        return secrets.randbelow(LARGEST_SEED) if seed is None else seed
    before = read_checkpoint(folder)
    now = _fingerprint(data, before["seed"] if seed is None else seed)
    before["description"] = _with_defaults(before["description"])
    changed = [key for key in now if now[key] != before[key]]
    if changed:
        name = {"description": "the description", "sha256": "an input file", "seed": "the seed"}[changed[-1]]
        raise StoreError(
            f"{folder} cannot be resumed because {name} changed since; undo the change, or start over with --force."
        )
    return int(before["seed"])


def start_checkpointing(folder: Path | None, data: Dataset, seed: int, resume: bool) -> Path | None:
    """Return the checkpoint to sample into, in a folder cleared of an earlier fit; nothing is touched before this."""
    if folder is None:
        return None
    if resume:
        remove_partial(folder)
    else:
        remove_earlier_fit(folder)
        start_checkpoint(folder / CHAIN, _fingerprint(data, seed))
    return folder / CHAIN


def start_checkpoint(path: Path, fingerprint: Mapping[str, Any]) -> None:
    """Make the sampler's checkpoint, which carries what it was started for.

    Raises:
        StoreError: The folder cannot be written.
    """
    with folder_to_write(path.parent), replace_atomically(path) as temporary:
        temporary.write_bytes(checkpoint_header(fingerprint))


def read_checkpoint(folder: Path) -> dict[str, Any]:
    """Return the fingerprint of the fit for which the checkpoint in a folder was started.

    Raises:
        StoreError: There is no checkpoint, or it is damaged.
    """
    path = folder / CHAIN
    if not path.exists():
        if (folder / FIT).exists():
            raise StoreError(
                f"{folder} holds a finished fit, whose checkpoint ({CHAIN}) is no longer there: nothing is left to resume. "
                "Read it with bowdenfit summary, or fit again with --force in the place of --resume."
            )
        raise StoreError(f"{folder} holds no checkpoint ({CHAIN}) to resume from; fit without --resume.")
    try:
        fingerprint = read_fingerprint(path)
        refuse_invalid_seed(fingerprint["seed"])
        if isinstance(fingerprint["description"], dict) and isinstance(fingerprint["sha256"], dict):
            return fingerprint
    except (OSError, ValueError, LookupError, TypeError, RecursionError):
        pass
    raise damaged_checkpoint_error(path)
