"""Which tunables an imported robot gets by default."""

from gaplab.services.core.world import Motor, World


def usual_tunables(world: World) -> tuple[str, ...]:
    """Return the labels of three or four tunables that usually explain a reality gap of a robot.

    - the friction of its contacts, if its base is free, or any body but a fixed base touches the ground,
    - the mass of its base, if it is free, else that of its heaviest moving body, which stands for the payload,
    - the response of its motors: their gain, or the damping of those that follow speeds; the largest torque, if they
      follow torques,
    - the damping of its joints, which no data sheet has.
    """
    moving = world.bodies[1:] if world.fixed else world.bodies
    if not moving:
        return ()
    heaviest = max(moving, key=lambda body: body.mass_kg) if world.fixed else world.bodies[0]
    touching = ["dynamic_friction"] if any(body.touches for body in moving) else []
    damping = ["joint_damping"] if world.joints else []
    return (*touching, f"mass({heaviest.name})", *_response(world), *damping)


def _response(world: World) -> tuple[str, ...]:
    """Return the label of the number that decides how most motors respond."""
    motors = [joint.motor for joint in world.actuators]
    if not motors:
        return ()
    kinds = ["gain" if motor is None or isinstance(motor, Motor) else motor.follows for motor in motors]
    labels = {"gain": "motor_gain", "position": "kp", "velocity": "kd", "torque": "max_torque"}
    return (labels[max(labels, key=kinds.count)],)
