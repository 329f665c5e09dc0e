"""What the learner says about itself: on `/diagnostics`, in the log, in answers."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.learner import Refresh
from control_field.parameters import Parameters
from control_field.words import counted
from learner_node.lessons import Lesson, NOTHING
from learner_node.phases import Phase
from learner_node.session import Session
from learner_node.settings import Settings
from msgs_bridge.bag_folder import EpisodeKind, TaskFolder
from msgs_bridge.command_line import names_of, Program


PROGRAM: Final = Program(
    'learner_node', 'records demonstrations and trials, learns after each, publishes the control '
    'field.', '-p task:=kitchen -p simulation:=true',
    names_of(Parameters, Settings) + ('start_poses',))


def sentence_at_start(settings: Settings, task: TaskFolder, refresh: Refresh | None) -> str:
    """Say what the task is, what is known of it, and what to do next."""
    begins = f'task {task.task} in {task.path.resolve()}: '
    if refresh is None:
        return (begins + 'nothing was learnt yet; show the way: s in teleop_node, or the service '
                '~/record_demonstration')
    service = '~/run_trials' if settings.simulation else f'{settings.controller}/start_trial'
    return begins + (f'{refresh.certificate.sentence()} Let it try: t in teleop_node, or the '
                     f'service {service}')


def diagnostic_from_session(
    name: str, session: Session, lesson: Lesson | None, refresh: Refresh | None,
    heard: Iterable[str], places: Mapping[str, str],
) -> DiagnosticStatus:
    """
    Write how the learner stands, with the certificate of the field in force.

    Parameters
    ----------
    name : str
        Of the node.
    session : Session
    lesson : Lesson or None
        The newest one.
    refresh : Refresh or None
        What is in force.
    heard : iterable of str
        Topics that something has arrived on.
    places : mapping
        Where trials start, where to teach next, in which bag which trial is.

    """
    values: dict[str, Any] = {
        'task': session.settings.task, 'phase': session.phase, 'trials_left': session.n_left,
        'revision': session.revision, 'episode': lesson.episode.number if lesson else 0,
        'doing': session.describe(), 'heard': ' '.join(sorted(heard)), **places,
        **(certificate_values(refresh) if refresh else {})}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if refresh or session.phase is not Phase.IDLE
        else DiagnosticStatus.STALE,
        name=f'{name.lstrip("/")}: learner', hardware_id=session.settings.task,
        message=refresh.certificate.sentence() if refresh else 'nothing was learnt yet',
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


def certificate_values(refresh: Refresh) -> dict[str, str]:
    """Return the certificate as texts by name."""
    certificate = refresh.certificate
    return {
        'prototypes': str(certificate.n_prototypes),
        'basin': f'{certificate.basin:.4f}', 'proven': f'{certificate.proven:.4f}',
        'fidelity': f'{certificate.fidelity:.4f}',
        'coherence_min': f'{certificate.coherence_min:.4f}',
        'known_free_cells': str(certificate.n_free), 'reachable': str(certificate.n_reachable),
        'sinks': ' '.join(f'({row},{col})' for row, col in certificate.sinks.tolist()),
        'pushed': str(refresh.pushed).lower(), 'not_pushed_because': refresh.reason}


def sentence_from_lesson(lesson: Lesson) -> str:
    """Say what an episode taught: plain sentences first, numbers in brackets at the end."""
    number = f'{lesson.episode.number:04d}'
    if lesson.refresh is None and lesson.episode.kind is EpisodeKind.DEMO:
        return f'Drive {number} is not learnt: {lesson.note.removeprefix(NOTHING)}'
    # People hear of a trial by the number that the controller counts, and look for its bag.
    status = lesson.read.status if lesson.read is not None else None
    trial = f' (trial {status.trial})' if status is not None and status.trial else ''
    if lesson.refresh is None:
        return f'{lesson.episode.name}{trial}: {lesson.note}'
    numbers = [lesson.note, lesson.refresh.certificate.numbers()]
    said = [f'{lesson.episode.name}{trial}: {lesson.note}']
    report = lesson.read.report if lesson.read is not None else None
    if lesson.read is not None and report is not None:
        said = [f'Drive {number} kept: {counted(report.n_steps, "step")}',
                lesson.moved, *report.sentences()]
        numbers[0] = '; '.join([report.numbers(), *lesson.read.notes])
    else:
        del numbers[0]
    said.append(lesson.refresh.certificate.sentence().rstrip('.'))
    if not lesson.refresh.pushed:
        said.append(f'The courses stay: {lesson.refresh.reason}')
    if report is not None:
        said.append('Press t in teleop_node to let the robot try')
    return '. '.join(filter(None, said)) + f'. ({"; ".join(numbers)})'
