"""A driver for `gaplab drive`: an arm of ROS 2, by JointTrajectory and JointState. What is in capitals is yours."""

import numpy as np
import rclpy
from rclpy.duration import Duration
from rclpy.signals import SignalHandlerOptions
from sensor_msgs.msg import JointState
from trajectory_msgs.msg import JointTrajectory
from trajectory_msgs.msg import JointTrajectoryPoint as Point

from gaplab import DriverMotion, MeasurementFailed, read_robot

ROBOT = "arm.json"  # of `gaplab robot import arm.urdf --fixed`, from the URDF that ROS has
TRAJECTORIES, STATES = "/joint_trajectory_controller/joint_trajectory", "/joint_states"
MOVE_S, BEGIN_S, STEP_S, LATE_S = 3.0, 4.0, 0.001, 5.0  # it is at the start after MOVE_S, and rests until BEGIN_S


class Driver:
    """Sends targets in rad, between which ros2_control draws lines, and rates the angles that it is told."""

    def connect(self) -> None:
        """Start a node; signals are for `gaplab drive`, which then calls `stop`."""
        rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
        self.robot, self.node, self.names, self.record = read_robot(ROBOT), rclpy.create_node("gaplab"), (), []
        self.sender = self.node.create_publisher(JointTrajectory, TRAJECTORIES, 1)
        self.node.create_subscription(JointState, STATES, self.hear, 100)

    def hear(self, state: JointState) -> None:
        """Note the time of a message, and the angles of the joints that are driven."""
        angles, at = dict(zip(state.name, state.position, strict=True)), state.header.stamp
        if angles.keys() >= set(self.names):
            self.record.append((at.sec + at.nanosec / 1e9, *(angles[name] for name in self.names)))

    def run(self, motion: DriverMotion) -> float | tuple[float, np.ndarray]:
        """Move slowly to the start, rest, run the motion, and return its fitness, perhaps with readings."""
        assert set(motion.units) <= {"rad", "m"}, f"positions are sent, not {motion.units}"
        self.names, self.record, self.stopped, now = motion.actuators, [], False, self.node.get_clock().now()
        points = [(MOVE_S, [motion.start[name] for name in self.names])]
        for at_s, row in zip(motion.times_s, motion.targets, strict=True):
            points += [(BEGIN_S + at_s - STEP_S, points[-1][1]), (BEGIN_S + at_s, row)]
        self.send(points, now.to_msg())
        begin_s, late = now.nanoseconds / 1e9 + BEGIN_S, now + Duration(seconds=BEGIN_S + motion.observe_s[-1] + LATE_S)
        while not self.record or self.record[-1][0] < begin_s + motion.observe_s[-1]:
            rclpy.spin_once(self.node, timeout_sec=0.1)
            if self.stopped or self.node.get_clock().now() > late or not self.sender.get_subscription_count():
                raise MeasurementFailed(f"it was stopped, or nobody is heard on {STATES} or hears {TRAJECTORIES}")
        times_s, *angles = np.array(self.record).T
        return self.robot.rated(times_s - begin_s, dict(zip(self.names, angles, strict=True)))

    def send(self, points: list, stamp: object) -> None:
        """Send angles to be reached at times after a stamp; 0 is its arrival."""
        made = [Point(positions=list(row), time_from_start=Duration(seconds=at_s).to_msg()) for at_s, row in points]
        message = JointTrajectory(joint_names=list(self.names), points=made)
        message.header.stamp = stamp
        self.sender.publish(message)

    def stop(self) -> None:
        """Let the arm hold where it was seen last; without a place, ros2_control ignores the message."""
        self.stopped = True
        self.send([(STEP_S, row[1:]) for row in self.record[-1:]], JointTrajectory().header.stamp)
