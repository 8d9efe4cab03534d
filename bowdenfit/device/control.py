"""A sampled controller that hides friction: counts of an encoder, a filtered speed, two laws, delay, noise and a limit.

The laws are equation 3 of the haptic paper, whose second case must read V < -dv, its variant that is linear inside the dead
zone, and the active one, which feeds back the torque measured at the joint.
"""

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp

from bowdenfit.device.transmission import Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Controller:
    """What the controller does at every sample; sampling itself belongs to the run.

    Args:
        coulomb: F_cst, fed forward outside the dead zone [N m]; 0 for none.
        dead_zone: dv [rad/s].
        linear: 1 if F_cst grows linearly inside the dead zone, else 0.
        gain: K_f, on the torque at the joint [1]; 0 for none.
        integral_gain: K_i, on its integral [1/s].
        active_zone: Speed below which the gains act, and F_cst does not [rad/s]; infinite for always, 0 for never.
        count: Angle of one count of the encoder [rad].
        filter_time: Time constant of the filter of the speed [s].
        largest_torque: Of the motor [N m].
    """

    coulomb: Numbers
    dead_zone: Numbers
    linear: Numbers
    gain: Numbers
    integral_gain: Numbers
    active_zone: Numbers
    count: Numbers
    filter_time: Numbers
    largest_torque: Numbers


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class ControllerMemory:
    """What a controller keeps from one sample to the next.

    Args:
        counted: Angle that the encoder showed [rad].
        speed: Filtered [rad/s].
        integral: Of the torque at the joint [N m s].
        command: Torque for the motor, which acts a sample later [N m].
    """

    counted: Numbers
    speed: Numbers
    integral: Numbers
    command: Numbers

    @classmethod
    def empty(cls, template: Numbers) -> "ControllerMemory":
        """Nothing has been seen."""
        zero = jnp.zeros_like(template)
        return cls(zero, zero, zero, zero)


def step_controller(
    control: Controller, memory: ControllerMemory, angle: Numbers, torque: Numbers, sample: float
) -> ControllerMemory:
    """The controller's next command, from the angle [rad] and the torque [N m] at the joint.

    Args:
        control: The controller.
        memory: What it kept.
        angle: Of the joint.
        torque: T_j as its sensor shows it.
        sample: T_s [s].
    """
    counted = jnp.floor(angle / control.count) * control.count
    raw = (counted - memory.counted) / sample
    speed = memory.speed + (raw - memory.speed) * (1 - jnp.exp(-sample / control.filter_time))
    is_active = jnp.abs(speed) < control.active_zone
    integral = jnp.where(is_active, memory.integral + sample * torque, 0.0)
    fed_back = -control.gain * torque - control.integral_gain * integral
    command = jnp.where(is_active, fed_back, karnopp_torque(control, speed))
    command = jnp.clip(command, -control.largest_torque, control.largest_torque)
    return replace(memory, counted=counted, speed=speed, integral=integral, command=command)


def karnopp_torque(control: Controller, speed: Numbers) -> Numbers:
    """F_cst in the direction of motion outside the dead zone; inside nothing, or a share of it [N m]."""
    inside = control.linear * control.coulomb * speed / jnp.maximum(control.dead_zone, 1e-12)
    return jnp.where(jnp.abs(speed) > control.dead_zone, control.coulomb * jnp.sign(speed), inside)
