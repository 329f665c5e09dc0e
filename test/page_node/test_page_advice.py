"""What goes on and what to do next: a code for each state, and words for each code."""

from dataclasses import replace
import itertools
import json

import pytest

from control_field.records import Outcome
from control_field.robot.collision_monitor import Intervention
from control_field.robot.stop_reasons import StopReason
from episode_store.episode import DRIVE_CODES
from learner_node.session.phases import CODES, Phase
from msgs_bridge.messages.trial_status import State, TrialStatus
from msgs_bridge.teaching.status import Status
from page_node.server.app import STATIC
from page_node.view.advice import advice_for
from page_node.view.situation import NO_TRIAL, reason_held, Situation

READY = Situation(Status(phase='idle', prototypes=3, basin=0.996), NO_TRIAL, True, True, True,
                  is_simulated=True, n_episodes=1)
NEW = replace(READY, status=Status(phase='idle'), n_episodes=0)
RECORDING = replace(NEW, status=Status(phase='demonstration', seconds=4.2))
RUNNING = replace(READY, status=replace(READY.status, phase='trial'),
                  trial=TrialStatus(State.RUNNING, 4, steps=7))
HELD = Intervention.BLOCKED.sentence


def paused(reason):
    return TrialStatus(State.PAUSED, 4, reason='in words', stop_reason=reason)


def ended(outcome, reason=None):
    return TrialStatus(State.ENDED, 4, outcome, reason='in words', steps=7, stop_reason=reason)


def with_status(situation, **changes):
    return replace(situation, status=replace(situation.status, **changes))


@pytest.mark.parametrize(('situation', 'code', 'because'), [
    (Situation(Status()), 'nobody', ''),
    (replace(READY, conflict='2 learners'), 'conflict', ''),
    (replace(READY, conflict='cells', has_other_cells=True, is_simulated=True), 'other_cells', ''),
    (replace(READY, conflict='cells', has_other_cells=True, is_simulated=False), 'conflict', ''),
    (replace(READY, has_robot=False), 'no_robot', ''),
    (replace(READY, has_controller=False), 'no_controller', ''),
    (replace(READY, has_learner=False), 'no_learner', ''),
    (with_status(READY, problem='nobody listens'), 'not_heard', ''),
    (NEW, 'show_first', ''),
    (replace(NEW, n_episodes=1), 'show_again', ''),
    (RECORDING, 'record_begin', ''),
    (replace(RECORDING, has_moved=True), 'record', ''),
    (replace(RECORDING, is_driven=True, is_stuck=True), 'does_not_move', ''),
    (replace(with_status(RECORDING, held=HELD), is_driven=True), 'record_held', 'held.blocked'),
    (with_status(RECORDING, held=HELD), 'record_begin', ''),
    (replace(READY, is_driven=True, is_stuck=True), 'does_not_move', ''),
    (replace(with_status(READY, held='who knows'), is_driven=True), 'drive_held', 'held.other'),
    (READY, 'try_simulated', ''),
    (replace(READY, is_simulated=False), 'try_real', ''),
    *((replace(READY, ended=code), f'recording_{code}', '')
      for code in ('left', 'intruded', 'disk')),
    (replace(READY, ended='who knows'), 'try_simulated', ''),
    *((with_status(READY, phase=phase), code, '') for phase, code in (
        ('settling', 'learning'), ('learning', 'learning'), ('waiting', 'starting'),
        ('placing', 'placing'), ('starting', 'starting'), ('trial', 'learning'))),
    (replace(with_status(READY, phase='waiting'), has_waited=True), 'waiting', ''),
    *((with_status(replace(READY, trial=ended(Outcome.GOAL)), phase=phase, trials_left=2),
       'trial_series', '') for phase in ('learning', 'waiting', 'placing', 'starting', 'trial')),
    (RUNNING, 'trial', ''),
    (with_status(RUNNING, trials_left=3), 'trial_series', ''),
    (with_status(RUNNING, held=HELD), 'trial_held', 'held.blocked'),
    (replace(RUNNING, trial=paused(StopReason.STALE_ODOMETRY)), 'trial_paused',
     'stopped.stale_odometry'),
    (replace(RUNNING, trial=paused(StopReason.TAKEN_OVER)), 'trial_corrected', ''),
    (replace(with_status(RUNNING, held=HELD), is_driven=True,
             trial=paused(StopReason.TAKEN_OVER)), 'trial_corrected_held', 'held.blocked'),
    (replace(READY, trial=ended(Outcome.GOAL)), 'ended_goal_simulated', ''),
    (replace(READY, trial=ended(Outcome.COLLISION, StopReason.STALLED)),
     'ended_collision_simulated', 'stopped.stalled'),
    (replace(READY, trial=ended(Outcome.STOPPED, StopReason.ASKED), is_simulated=False),
     'ended_asked_real', ''),
    (replace(READY, trial=ended(Outcome.GOAL), is_simulated=False, tries_left=2),
     'drive_back', '')])
def test_every_state_has_a_code(situation, code, because):
    advice = advice_for(situation)
    assert (advice.code, advice.because) == (code, because)


def test_what_is_not_all_of_it_is_never_all():
    assert advice_for(READY).values == {'share': 99}
    assert advice_for(with_status(READY, basin=1.0)).values == {'share': 100}


def all_situations():
    """Return what can come together, and much that cannot."""
    trials = [NO_TRIAL, TrialStatus(State.RUNNING, 4),
              *(paused(reason) for reason in StopReason if reason.outcome is None),
              *(ended(outcome, reason) for outcome in Outcome for reason in (None, *StopReason))]
    helds = ['', 'something else', *(each.sentence for each in Intervention if each.sentence)]
    for phase, trial, held in itertools.product(Phase, trials, helds):
        for flags in itertools.product((True, False), repeat=4):
            simulated, driven, moved, waited = flags
            status = Status(phase=phase, prototypes=3, held=held)
            yield replace(READY, status=status, trial=trial, is_simulated=simulated,
                          is_driven=driven, has_moved=moved, has_waited=waited)


def test_whatever_happens_there_are_words_in_every_language():
    told = {(advice.code, advice.because) for advice in map(advice_for, all_situations())}
    told |= {(code, '') for code in ('nobody', 'conflict', 'other_cells', 'no_robot',
                                     'no_controller',
                                     'no_learner', 'not_heard', 'show_first', 'show_again',
                                     'does_not_move', 'drive_back', 'recording_left',
                                     'recording_intruded', 'recording_disk')}
    for path in (STATIC / 'strings').glob('*.json'):
        words = json.loads(path.read_text())
        missing = [(code, because) for code, because in told
                   if not {f'advice.{code}', f'advice.{code}.other'} & set(words)
                   or (because and because not in words)]
        assert not missing, path.name


#: Of refusals, beside those of the learner's phases and of drives that teach nothing.
REFUSALS = (
    'bags', 'busy', 'conflict', 'disk', 'intruded', 'left', 'may_go_on', 'no_answer',
    'no_connection', 'no_controller', 'no_learner', 'no_robot', 'no_trials', 'not_learnt',
    'not_recording', 'not_set', 'nothing_learnt', 'nothing_there', 'nowhere', 'real_robot',
    'refused', 'too_fast', 'unknown')


def test_every_refusal_has_words():
    words = json.loads((STATIC / 'strings' / 'en.json').read_text())
    codes = {*REFUSALS, *CODES.values(), *DRIVE_CODES.values()}
    assert not [code for code in codes if not {f'refused.{code}', f'why.{code}'} & set(words)]


@pytest.mark.parametrize('reason', Intervention)
def test_why_it_is_held_is_known_from_the_controllers_sentence(reason):
    assert reason_held(reason.sentence) == (str(reason) if reason.sentence else '')
    if reason.sentence:
        assert reason_held(f'{reason.sentence}: and more') == reason
