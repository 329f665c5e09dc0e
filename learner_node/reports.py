"""Reports of the learner: its diagnostics, and sentences for the log and for answers."""

from collections.abc import Iterable, Mapping
from typing import Any, Final

from diagnostic_msgs.msg import DiagnosticStatus, KeyValue

from control_field.learning.learner import Refresh
from control_field.parameters import Parameters
from control_field.records import Trial
from control_field.words import counted, how_it_ended, sentences
from episode_store.episode import Content
from episode_store.relearn import LearntBag
from episode_store.task_folder import EpisodeKind, TaskFolder
from learner_node.session.phases import Phase
from learner_node.session.session import Session
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
    Return the status of the learner, with the certificate of the published field.

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
        'episode': learnt_bag.folder.number if learnt_bag else 0,
        'doing': state.describe(), 'heard': ' '.join(sorted(heard)), **places,
        **(certificate_values(refresh) if refresh else {})}
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if refresh or state.phase is not Phase.IDLE
        else DiagnosticStatus.STALE,
        name=f'{name.lstrip("/")}: learner', hardware_id=state.settings.task,
        message=refresh.certificate.sentence() if refresh else 'nothing was learnt yet',
        values=[KeyValue(key=key, value=str(value)) for key, value in values.items()])


def certificate_values(refresh: Refresh) -> dict[str, str]:
    """Return the values of the certificate as texts, by name."""
    certificate = refresh.certificate
    return {
        'prototypes': str(certificate.n_prototypes),
        'basin': f'{certificate.basin:.4f}', 'proven': f'{certificate.proven:.4f}',
        'fidelity': f'{certificate.fidelity:.4f}',
        'coherence_min': f'{certificate.coherence_min:.4f}',
        'known_free_cells': str(certificate.n_free), 'reachable': str(certificate.n_reachable),
        'sinks': ' '.join(f'({row},{col})' for row, col in certificate.sinks.tolist()),
        'confirmed': f'{certificate.confirmed:.4f}', 'oldest': str(certificate.oldest),
        'doubted': ' '.join(f'({row},{col})' for row, col in certificate.doubted.tolist()),
        'leaning': f'{certificate.leaning:.4f}',
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
    refresh, content = learnt_bag.refresh, learnt_bag.content
    if refresh is None or content is None:
        if learnt_bag.folder.kind is EpisodeKind.DEMO:
            why = '; '.join(filter(None, [learnt_bag.why_not, learnt_bag.missing]))
            return f'{name} is not learnt: {why}'
        return f'{name}: {learnt_bag.note}'
    said = [learnt_bag.moved,
            *(content.report.sentences() if content.report is not None else ()),
            *content.notes,
            learnt_bag.missing, refresh.certificate.sentence()]
    if not refresh.pushed:
        said.append(f'The robot keeps its old courses: {refresh.reason}')
    return sentences([f'{name} {_what_was_done(content)}',
                      *(part[:1].upper() + part[1:] for part in said)])


def name_from_learnt_bag(learnt_bag: LearntBag) -> str:
    """Name an episode: a drive, or a trial by the numbers of controller and bag."""
    if learnt_bag.folder.kind is EpisodeKind.DEMO:
        return f'Drive {learnt_bag.folder.number:04d}'
    trial, bag = trial_number(learnt_bag), learnt_bag.folder.name
    return f'Trial {trial} ({bag})' if trial else f'Trial {bag}'


def trial_number(learnt_bag: LearntBag) -> int:
    """Return the controller's number of a trial; 0 if it is not known."""
    status = None if learnt_bag.content is None else learnt_bag.content.status
    return 0 if status is None else status.trial


def _what_was_done(content: Content) -> str:
    record, report = content.record, content.report
    if isinstance(record, Trial):
        return how_it_ended(record.outcome, record.n_steps)
    steps = report.n_steps if report is not None else len(record.cells) - 1
    return f'kept: {counted(steps, "step")}'


def numbers_from_learnt_bag(learnt_bag: LearntBag) -> str:
    """Return in numbers what an episode taught."""
    if learnt_bag.refresh is None or learnt_bag.content is None:
        return ''
    report = learnt_bag.content.report
    return '; '.join([*([report.numbers()] if report is not None else []),
                      f'{counted(learnt_bag.refresh.reinforcements, "reinforcement")} learnt',
                      learnt_bag.refresh.certificate.numbers()])
