"""What the learner says about itself: on `/diagnostics`, in the log, in answers."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.learning.learner import Refresh
from control_field.parameters import Parameters
from control_field.records import Trial
from control_field.words import counted, how_it_ended, sentences
from episode_store.episode import Episode
from episode_store.relearn import LearntBag, NOTHING
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_node.phases import Phase
from learner_node.session import Session
from learner_node.settings import Settings
from msgs_bridge.node.command_line import names_of, Program

PROGRAM: Final = Program(
    'learner_node', 'records demonstrations and trials, learns after each, publishes the control '
    'field.', '-p task:=kitchen -p simulation:=true',
    names_of(Parameters, Settings) + ('start_poses',))
#: What a person who has shown a way does next.
NEXT: Final = 'Press t in teleop_node to let the robot try.'


def sentence_at_start(settings: Settings, task: TaskFolder, refresh: Refresh | None) -> str:
    """Say what the task is, what is known of it, and what to do next."""
    begins = f'task {task.task} in {task.path.resolve()}: '
    if refresh is None:
        return (begins + 'nothing was learnt yet; press s in teleop_node and show the way'
                ' (or call ~/record_demonstration)')
    service = '~/run_trials' if settings.simulation else f'{settings.controller}/start_trial'
    return begins + (f'{refresh.certificate.sentence()} Press t in teleop_node to let it try '
                     f'(or call {service})')


def diagnostic_from_session(
    name: str, session: Session, learnt_bag: LearntBag | None, refresh: Refresh | None,
    heard: Iterable[str], places: Mapping[str, str],
) -> DiagnosticStatus:
    """
    Write how the learner stands, with the certificate of the field in force.

    Parameters
    ----------
    name : str
        Of the node.
    session : Session
    learnt_bag : LearntBag or None
        The newest one.
    refresh : Refresh or None
        What is in force.
    heard : iterable of str
        Topics that something has arrived on.
    places : mapping
        Where trials start, where to teach next, in which bag which trial is.

    """
    state = session.state
    values: dict[str, Any] = {
        'task': state.settings.task, 'phase': state.phase,
        'trials_left': session.series.n_left, 'revision': state.revision,
        'episode': learnt_bag.episode.number if learnt_bag else 0,
        'doing': state.describe(), 'heard': ' '.join(sorted(heard)), **places,
        **(certificate_values(refresh) if refresh else {})}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if refresh or state.phase is not Phase.IDLE
        else DiagnosticStatus.STALE,
        name=f'{name.lstrip("/")}: learner', hardware_id=state.settings.task,
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


def sentence_from_learnt_bag(learnt_bag: LearntBag, name: str = '') -> str:
    """
    Say what an episode taught, in plain sentences; `numbers_from_learnt_bag` has the rest.

    Parameters
    ----------
    learnt_bag : LearntBag
    name : str
        What the episode is called; empty: as in ``Drive 0001``.

    """
    name = name or name_from_learnt_bag(learnt_bag)
    refresh, read = learnt_bag.refresh, learnt_bag.read
    if refresh is None or read is None:
        why = learnt_bag.note
        if learnt_bag.episode.kind is EpisodeKind.DEMO:
            return f'{name} is not learnt: {why.removeprefix(NOTHING)}'
        return f'{name}: {why}'
    said = [learnt_bag.moved,
            *(read.report.sentences() if read.report is not None else ()), *read.notes,
            learnt_bag.missing, refresh.certificate.sentence()]
    if not refresh.pushed:
        said.append(f'The robot keeps its old courses: {refresh.reason}')
    return sentences([f'{name} {_what_was_done(read)}',
                      *(part[:1].upper() + part[1:] for part in said)])


def name_from_learnt_bag(learnt_bag: LearntBag) -> str:
    """Name an episode: a drive, or a trial by the controller's number and by its bag's."""
    if learnt_bag.episode.kind is EpisodeKind.DEMO:
        return f'Drive {learnt_bag.episode.number:04d}'
    trial, bag = trial_number(learnt_bag), learnt_bag.episode.name
    return f'Trial {trial} ({bag})' if trial else f'Trial {bag}'


def trial_number(learnt_bag: LearntBag) -> int:
    """Return the number by which the controller counts a trial; 0 where that is not known."""
    status = learnt_bag.read.status if learnt_bag.read is not None else None
    return status.trial if status is not None else 0


def _what_was_done(read: Episode) -> str:
    if isinstance(read.record, Trial):
        return how_it_ended(read.record.outcome, read.record.n_steps)
    steps = read.report.n_steps if read.report is not None else len(read.record.cells) - 1
    return f'kept: {counted(steps, "step")}'


def numbers_from_learnt_bag(learnt_bag: LearntBag) -> str:
    """Return what an episode taught in numbers, for who wants to know more."""
    if learnt_bag.refresh is None or learnt_bag.read is None:
        return ''
    report = learnt_bag.read.report
    return '; '.join([*([report.numbers()] if report is not None else []),
                      f'{counted(learnt_bag.refresh.reinforcements, "reinforcement")} learnt',
                      learnt_bag.refresh.certificate.numbers()])
