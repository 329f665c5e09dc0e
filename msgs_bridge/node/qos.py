"""The quality-of-service profiles of the topics, each named once."""

from collections.abc import Callable, Sequence
from typing import Any, Final

from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.node import Node
from rclpy.qos import (
    DurabilityPolicy, HistoryPolicy, qos_profile_sensor_data, QoSProfile, ReliabilityPolicy)


def _reliable(depth: int, durability: DurabilityPolicy = DurabilityPolicy.VOLATILE) -> QoSProfile:
    return QoSProfile(  # type: ignore[no-untyped-call]
        history=HistoryPolicy.KEEP_LAST, depth=depth,
        reliability=ReliabilityPolicy.RELIABLE, durability=durability)


#: How a robot publishes `odom`; it is read as `SENSOR`.
ODOMETRY_PUB: Final = _reliable(10)
#: Sensor data, best effort: `neighbourhood`, and how `odom` is read.
SENSOR: Final = qos_profile_sensor_data
#: `cmd_vel`: only the newest command counts.
COMMAND: Final = _reliable(1)
#: How ticks and their answers are read in lock-step, where none may be lost, whatever others send
#: in between.
LOCKSTEP: Final = _reliable(1000)
#: How they are published: a lock-step does not wait for who records it, and a short queue would
#: drop what has not got through to one that the machine does not let run for a while. What was
#: published is kept for a recorder that slept so long that it was taken for gone (ADR 23).
LOCKSTEP_PUB: Final = _reliable(4000, DurabilityPolicy.TRANSIENT_LOCAL)
#: `control_field`, `prototypes`, `trial`, `map`, `markers`: a late reader gets the newest.
LATCHED: Final = _reliable(1, DurabilityPolicy.TRANSIENT_LOCAL)
#: `/tf_static`: every part of a robot says its own, and a late reader gets all of them.
STATIC_FRAMES: Final = _reliable(100, DurabilityPolicy.TRANSIENT_LOCAL)
#: `/tf`: many say a little of it each.
FRAMES: Final = _reliable(100)
#: `experience`: no decision may be lost.
EXPERIENCE: Final = QoSProfile(  # type: ignore[no-untyped-call]
    history=HistoryPolicy.KEEP_ALL, depth=0,
    reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.VOLATILE)
#: How the controller publishes it: kept, so that who was away can fetch what it missed; and how
#: that is fetched. Who reads it as `EXPERIENCE` gets only what is new.
EXPERIENCE_KEPT: Final = QoSProfile(  # type: ignore[no-untyped-call]
    history=HistoryPolicy.KEEP_ALL, depth=0,
    reliability=ReliabilityPolicy.RELIABLE, durability=DurabilityPolicy.TRANSIENT_LOCAL)
#: `goal_pose`, `initialpose`.
POSE: Final = _reliable(1)
#: How `contact` is read: one subscription each, so that every bumper is read, however it
#: publishes, and not through a lossy one alone. What then comes up to three times says the same.
CONTACTS: Final = (LATCHED, _reliable(10), SENSOR)
#: How a costmap is read: Nav2's is latched and reliable, and a large one rarely survives the way
#: between processes otherwise; others are best effort. What comes twice is taken once.
COSTMAPS: Final = CONTACTS
#: How a localisation is read: AMCL's pose is latched, others are not.
LOCALISATIONS: Final = (LATCHED, SENSOR)
#: How `/diagnostics` is read.
DIAGNOSTICS: Final = _reliable(50)
#: How a recorder reads what others publish reliably: whatever waits while it is busy is kept.
RECORDING: Final = _reliable(2000)
#: The same where it is published best effort.
RECORDING_BEST_EFFORT: Final = QoSProfile(  # type: ignore[no-untyped-call]
    history=HistoryPolicy.KEEP_LAST, depth=2000,
    reliability=ReliabilityPolicy.BEST_EFFORT, durability=DurabilityPolicy.VOLATILE)
#: The same for the newest of the latched topics, with what was published before.
RECORDING_LATCHED: Final = _reliable(2000, DurabilityPolicy.TRANSIENT_LOCAL)
#: How a recorder fetches what a lock-step has published while it was away.
RECORDING_KEPT: Final = _reliable(4000, DurabilityPolicy.TRANSIENT_LOCAL)
#: `CONTACTS`, for a recorder.
RECORDING_CONTACTS: Final = (RECORDING_LATCHED, RECORDING, RECORDING_BEST_EFFORT)


def create_quiet_publisher(node: Node, kind: type, topic: str, profile: QoSProfile) -> Any:
    """
    Return a publisher that does not warn of incompatible subscriptions.

    Some readers have several, see `subscribe_all`: another of them fits, or they warn themselves.
    """
    return node.create_publisher(
        kind, topic, profile, event_callbacks=PublisherEventCallbacks(use_default_callbacks=False))


def subscribe_all(
    node: Node, kind: type, topic: str, callback: Callable[[Any], None],
    profiles: Sequence[QoSProfile], **options: Any,
) -> list[Any]:
    """
    Subscribe to a topic once a profile, and return the subscriptions.

    What arrives more than once is for the callback to see to. With several, none warns of an
    incompatible publisher: another fits.
    """
    is_alone = len(profiles) == 1
    return [node.create_subscription(
        kind, topic, callback, profile, **options,
        event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=is_alone))
        for profile in profiles]
