"""The result of a demo: numbers for `report.json`, a table, and whether it matches the paper."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import json
from pathlib import Path
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from control_field.learning.grid_world import GridWorld
from control_field.learning.learner import Refresh
from control_field.records import ControlField, Kind, Outcome, Trial
from control_field.words import counted
from episode_store.episode import Episode
from episode_store.relearn import LearntBag, Relearner
from episode_store.rosbag2.errors import BagError
from episode_store.rosbag2.topic_tables import pose_table, PoseTable
from episode_store.task_folder import EpisodeKind, TaskFolder
from experience_cli.output import write_output
from experience_cli.terminal import table_lines
from world_maps.mover import Mover
from world_maps.world import World

#: From this trial on the goal is reached every time, and after it nothing is reinforced.
MASTERED: Final = 3
_TITLES: Final = ('task', 'trial', 'steps', 'prototypes', 'reinforcements', 'collisions',
                  'outcome', 'seconds')


@dataclass(frozen=True, eq=False)
class TrialReport:
    """
    The result of a trial.

    Parameters
    ----------
    trial : int
        From 1.
    steps, hidden_neurons, reinforcements, collisions : int
        Hidden neurons are those after it was learnt from.
    outcome : str
    seconds : float
        Of simulated or real time, whatever the robot lived in.
    path : ndarray, shape (n, 2), [m]
        Where the robot drove.
    corrected : ndarray, shape (m, 2), [m]
        Centres of the cells in which the field led into something that the local grid had seen.
    home : ndarray of bool, shape (n_rows, n_cols)
        Cells from which the field alone, without local grid, then leads to the goal in the true
        world.

    """

    trial: int
    steps: int
    hidden_neurons: int
    reinforcements: int
    collisions: int
    outcome: str
    seconds: float
    path: npt.NDArray[np.float64]
    corrected: npt.NDArray[np.float64]
    home: npt.NDArray[np.bool_]

    def to_json(self) -> dict[str, Any]:
        """Return its entry in `report.json`."""
        return {name: getattr(self, name) for name in (
            'trial', 'steps', 'hidden_neurons', 'reinforcements', 'collisions', 'outcome',
            'seconds')}


@dataclass(frozen=True, eq=False)
class TaskReport:
    """
    The result of a task.

    Parameters
    ----------
    name : str
    demonstrated, final : Refresh
        After the demonstration and in the end.
    demonstration : ndarray, shape (n, 2), [m]
        Where the person drove.
    home : ndarray of bool, shape (n_rows, n_cols)
        As of a trial, but after the demonstration.
    reachable : ndarray of bool, shape (n_rows, n_cols)
        Cells of the true world from which there is a way to the goal, without the goal itself.
    trials : sequence of TrialReport
    n_aborted : int
        Trials that were broken off and run again.
    other_starts : mapping
        The results of trials from other starts.
    world : World
        The truth.
    movers : tuple of Mover
        Who moved in it.
    settings : mapping of str to object
        Learning parameters of this task alone.

    """

    name: str
    demonstrated: Refresh
    final: Refresh
    demonstration: npt.NDArray[np.float64]
    home: npt.NDArray[np.bool_]
    reachable: npt.NDArray[np.bool_]
    trials: Sequence[TrialReport]
    n_aborted: int
    other_starts: Mapping[str, Any]
    world: World
    movers: tuple[Mover, ...] = ()
    settings: Mapping[str, object] = field(default_factory=dict)

    def field_success(self) -> list[float]:
        """
        Return from which share of all places the field alone leads to the goal.

        After the demonstration and after each trial; without local grid, in the true world.
        """
        return [float(home[self.reachable].mean()) if self.reachable.any() else 1.0
                for home in (self.home, *(trial.home for trial in self.trials))]

    def to_json(self) -> dict[str, Any]:
        """Return its entry in `report.json`."""
        certificate = self.final.certificate
        return {
            'trials': [trial.to_json() for trial in self.trials],
            'field_success': self.field_success(),
            'aborted': self.n_aborted,
            'settings': dict(self.settings),
            'other_starts': dict(self.other_starts),
            'certificate': {
                'basin': certificate.basin, 'proven': certificate.proven,
                'sinks': certificate.sinks.tolist(), 'fidelity': certificate.fidelity,
                'prototypes': certificate.n_prototypes, 'confirmed': certificate.confirmed,
                'doubted': certificate.doubted.tolist(), 'leaning': certificate.leaning}}

    def problems(self) -> Iterator[str]:
        """Yield a sentence for each way in which it falls short of the paper's result."""
        if self.movers:  # who is met when is another thing in every trial, and contacts are theirs
            return
        n = sum(trial.collisions for trial in self.trials)
        if n or self.other_starts['collisions']:
            yield (f'{self.name}: {counted(n + self.other_starts["collisions"], "collision")}, '
                   f'must be 0')
        if self.settings:  # the paper's numbers are those of the paper's
            if self.trials and self.trials[-1].outcome != Outcome.GOAL:
                yield f'{self.name}: the last trial ended with {self.trials[-1].outcome}'
            return
        for trial in self.trials:
            if trial.trial >= MASTERED and trial.outcome != Outcome.GOAL:
                yield (f'{self.name}: trial {trial.trial} ended with {trial.outcome}, must reach '
                       f'the goal from trial {MASTERED} on')
            if trial.trial > MASTERED and trial.reinforcements:
                yield (f'{self.name}: trial {trial.trial} used '
                       f'{counted(trial.reinforcements, "reinforcement")}, must use none after '
                       f'trial {MASTERED}')


def report_from_bags(task: TaskFolder, world: World, seed: int) -> TaskReport:
    """
    Relearn a task from its bags, and try the final field from everywhere else.

    Raises
    ------
    BagError
        If the bags cannot be read, or hold no demonstration.

    """
    folders = task.episodes()
    if not folders:
        raise BagError(f'{task.path} holds no bags')
    header = Episode(folders[0]).header
    relearner = Relearner.for_header(header)
    learnt_bags = [relearner.learn(Episode(folder)) for folder in folders]
    demonstrated = next((bag for bag in learnt_bags if bag.refresh is not None), None)
    if demonstrated is None:
        raise BagError(f'{task.path} holds no demonstration that was kept')
    truth = GridWorld(world.occupancy, relearner.parameters)
    trials: list[TrialReport] = []
    for bag in learnt_bags:
        if bag.folder.kind is EpisodeKind.TRIAL and bag.refresh is not None:
            trials.append(_trial_report(len(trials) + 1, bag, truth))
    assert demonstrated.refresh is not None
    assert relearner.refresh is not None
    n_aborted = sum(bag.folder.kind is EpisodeKind.TRIAL and bag.refresh is None
                    for bag in learnt_bags)
    start = header.grid.cell_from_world(*trials[0].path[0]) if trials else (0, 0)
    field = relearner.refresh.field
    return TaskReport(
        task.task, demonstrated.refresh, relearner.refresh,
        driven_path(Episode(demonstrated.folder))[1], truth.flow_home(demonstrated.refresh.field),
        places_of(truth, field), trials, n_aborted,
        other_starts(field, relearner, world, start, seed), world)


def places_of(truth: GridWorld, field: ControlField) -> npt.NDArray[np.bool_]:
    """Return the cells of the true world with a way to the goal, the goal itself excluded."""
    reachable = np.isfinite(truth.cost_to(field.goal))
    reachable[field.goal] = False
    return reachable


def _trial_report(number: int, bag: LearntBag, truth: GridWorld) -> TrialReport:
    assert bag.content is not None
    assert bag.refresh is not None
    trial, status = bag.content.record, bag.content.status
    assert isinstance(trial, Trial)
    episode = Episode(bag.folder)
    stamps, path = driven_path(episode)
    if status is not None:
        # The robot's last tick may come before or after the word that the trial is over.
        driven = stamps <= status.stamp
        stamps, path = stamps[driven], path[driven]
    blocked = trial.decisions[trial.decisions['kind'] == Kind.BLOCKED]
    cells = np.stack([blocked['row'], blocked['col']], axis=1)
    return TrialReport(
        number, trial.n_steps, len(bag.refresh.prototypes), bag.refresh.reinforcements,
        n_contacts(episode), str(trial.outcome),
        round(float(stamps[-1] - stamps[0]), 3) if len(stamps) else 0.0, path,
        episode.header.grid.world_from_cells(cells), truth.flow_home(bag.refresh.field))


def driven_path(episode: Episode) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
    """Return stamps (n,) [s] and positions (n, 2) [m] of the odometry in a bag."""
    poses = driven_poses(episode)
    return poses.stamps, poses.xy


def driven_poses(episode: Episode) -> PoseTable:
    """Return the odometry in a bag."""
    return pose_table(episode.messages('odom'), episode.header.grid.frame_id)


def n_contacts(episode: Episode) -> int:
    """Return how often the robot ran into something in a bag."""
    return sum(message[4] for message in episode.messages('contact'))


def other_starts(
    field: ControlField, relearner: Relearner, world: World, taught: tuple[int, int], seed: int,
) -> dict[str, Any]:
    """Try a field, with the local grid, from every free cell with a way to the goal but one."""
    grid = GridWorld(world.occupancy, relearner.parameters)
    reachable = places_of(grid, field)
    reachable[taught] = False
    cells = np.argwhere(reachable)
    runs = grid.trials(field, cells, seed)
    reached = runs.outcome == 0
    return {
        'starts': len(cells), 'reached': int(reached.sum()),
        'success': float(reached.mean()) if len(cells) else None,
        'collisions': int((runs.outcome == 1).sum()),
        'reinforcements': int(runs.n_reinforcements.sum()),
        'mean_steps': float(runs.n_steps[reached].mean()) if reached.any() else None,
        'field_success': float(grid.flow_home(field)[reachable].mean()) if len(cells) else None,
        'failed': cells[~reached].tolist()}


def write_report(path: Path, reports: Sequence[TaskReport], config: Mapping[str, Any]) -> None:
    """Write `report.json`."""
    content = {'config': dict(config), 'tasks': {
        report.name: report.to_json() for report in reports}}
    text = (json.dumps(content, indent=2) + '\n').encode()
    write_output(path, lambda file: file.write(text))


def report_lines(reports: Sequence[TaskReport]) -> Iterator[str]:
    """Yield the result in sentences, then as a table, line by line."""
    yield ''
    for report in reports:
        other = report.other_starts
        collisions = counted(other['collisions'], 'collision')
        yield (f'{report.name}: {report.final.certificate.sentence()} Set down at '
               f'{other["starts"]} other starts it reached the goal '
               f'{counted(other["reached"], "time")}, with {collisions}.')
    yield ''
    yield from table_lines([_TITLES, *(
        (report.name, str(trial.trial), str(trial.steps), str(trial.hidden_neurons),
         str(trial.reinforcements), str(trial.collisions), trial.outcome, f'{trial.seconds:.1f}')
        for report in reports for trial in report.trials)], right=(1, 2, 3, 4, 5, 7))
    yield ''
    yield ('Prototypes: places with the direction the robot has learnt there (in the paper hidden '
           'neurons).')
    yield 'Reinforcements: rewards and punishments that the trial was learnt from.'
    if any(report.movers for report in reports):
        yield ('Collisions: every contact; a trial that went on after one had been run into while '
               'the robot stood.')
