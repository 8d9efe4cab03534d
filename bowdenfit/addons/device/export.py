"""Export for simulators and controllers: the formats FMU and MuJoCo, and what may be compensated, for YAML."""

from pathlib import Path
from typing import Any

from bowdenfit.addons.device.compensate.answer import Compensation, FeedbackGain, FeedForward
from bowdenfit.addons.device.compensate.limits import estimate_compensation, parse_risk
from bowdenfit.addons.device.fmu import build_fmu
from bowdenfit.addons.device.loop import read_device_with_ring_down
from bowdenfit.addons.device.mujoco import mujoco_model
from bowdenfit.inference.interval import Interval
from bowdenfit.questions.export.writers import ExportFormat, ExportRequest, FileContent
from bowdenfit.results.record import Record


def _write_fmu(request: ExportRequest) -> FileContent:
    return FileContent(build_fmu(request.tables, request.fit.name))


def _write_mujoco(request: ExportRequest) -> FileContent:
    text, remarks = mujoco_model(request.tables, request.point, request.path)
    return FileContent(text.encode("ascii"), remarks)


FMU = ExportFormat("an FMU", ".fmu", _write_fmu)
MUJOCO = ExportFormat("MuJoCo", ".xml", _write_mujoco, callback_ending=".py", holds_at_one_point=True)


def estimate_parameters(fit: Record, device: Path) -> dict[str, Any]:
    """Return what may be compensated on a device, as parameters of a controller in plain data.

    Args:
        fit: The fit.
        device: Its device.toml.

    Raises:
        UsageError, DescriptionError: The cable is no loop, or the device does not state what is needed.
    """
    answer, _ = estimate_compensation(fit, read_device_with_ring_down(fit, device), None, None, parse_risk(None))
    return compensation_parameters(answer)


def compensation_parameters(answer: Compensation) -> dict[str, Any]:
    """Return the answer in plain data; what it does not hold is left out.

    Args:
        answer: Answer of both laws.
    """
    bends = answer.by_bend
    page: dict[str, Any] = {
        "device": answer.device,
        "wrap_angle_deg": [bend.wrap_angle for bend in bends],
        "accepted_probability": answer.risk,
        "mounting_scatter": answer.scatter,
        "mounting_scatter_is_measured": answer.scatter_from_fit,
        "probability_of_slack": answer.slack,
        "friction_N_m": {
            "q05": [bend.friction.q05 for bend in bends],
            "q50": [bend.friction.median for bend in bends],
            "q95": [bend.friction.q95 for bend in bends],
        },
        "dead_zone_rad_per_s": answer.dead_zone or None,
        "chatters_below_rad_per_s": answer.chatters_below,
    }
    if answer.fixed is not None:
        page["fixed"] = {"torque_N_m": answer.fixed.torque, **_list_feed_forward(answer.fixed)}
    if answer.scheduled is not None:
        page["scheduled"] = {
            "torque_N_m": [bend.scheduled for bend in bends],
            **_list_feed_forward(answer.scheduled),
        }
    if answer.gain is not None:
        page["gain"] = _list_gain(answer.gain)
    return page | {"not_stated": list(answer.missing)}


def _list_feed_forward(feed_forward: FeedForward) -> dict[str, float]:
    return {
        "share": feed_forward.share,
        "probability_of_moving_by_itself": feed_forward.risk,
        "left_N_m": feed_forward.left,
    }


def _list_gain(gain: FeedbackGain) -> dict[str, Any]:
    return {
        "safe": gain.safe,
        "passive": gain.passive,
        "stable_up_to": _list_quantiles(gain.stable),
        "left_N_m": _list_quantiles(gain.left),
        "decided_by": gain.decided_by,
    }


def _list_quantiles(interval: Interval) -> dict[str, float]:
    return {"q05": interval.q05, "q50": interval.median, "q95": interval.q95}
