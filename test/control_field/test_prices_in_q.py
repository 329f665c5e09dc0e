from hypothesis import given
from hypothesis import strategies as st
import numpy as np

from control_field.grid import Grid
from control_field.headings import STEP_COL, STEP_ROW
from control_field.kernels import compiled
from control_field.kernels.decision import take_in_cell
from control_field.kernels.steps import no_preference, plain_ground
from control_field.parameters import Parameters
from control_field.records import ControlField
from control_field.robot.policy import ground_of, prices_in_q, rules_of, trial_on, TrialPolicy
from strategies import few, knowns, relearner, seeds, steady, taught


PARAMETERS = Parameters()


def priced(known, prices, goal, discount=PARAMETERS.discount):
    """Return the cost to go and the Q-matrix of ground with so high a price for each cell."""
    ground, none = plain_ground(known, rules_of(PARAMETERS)), no_preference(known.shape)
    ground = ground._replace(factor=prices)
    cost = compiled.cost_to_go(ground, goal, none)
    q = compiled.q_from_cost(ground, cost, none, discount)
    return np.where(known == 100, np.inf, cost), q.astype(np.float32)


def policy_on(prices, goal=(0, 0)):
    """Return the policy of a trial on open ground with so high a price for each cell."""
    shape, none = prices.shape, np.zeros(prices.shape, np.float32)
    _, q = priced(np.zeros(shape, np.int8), prices, goal)
    field = ControlField(Grid(*shape, 1.0), 3, goal, none, none, none, q,
                         np.zeros(shape, np.int8), np.zeros(shape, np.uint8))
    return TrialPolicy(field, PARAMETERS, np.random.default_rng(0), 1)


@given(knowns, st.floats(0.7, 0.99), seeds)
@steady
def test_the_prices_of_steps_are_read_back_from_q(known, discount, seed):
    prices = np.random.default_rng(seed).uniform(0.05, 9.0, known.shape)
    known[0, 0] = 0
    cost, q = priced(known, prices, (0, 0), discount)
    entered = np.zeros(known.shape, np.bool_)
    for row, col, heading in np.argwhere(q > 1e-30).tolist():
        entered[row + STEP_ROW[heading], col + STEP_COL[heading]] = True
    read = prices_in_q(q, cost, np.full(known.shape, 11.0), discount)
    assert np.allclose(read[entered], prices[entered], atol=1e-3)
    assert (read[~entered & (cost < 100.0)] == 11.0).all()


@given(relearner(), st.sampled_from([0.5, 0.95, 0.9999]))
@few
def test_on_a_field_that_does_not_explore_steps_cost_what_they_did(learnt_bag, discount):
    occupancy, cells = learnt_bag
    learner = taught(cells, occupancy.shape, occupancy, discount=discount)
    field = learner.refresh.field
    planned = learner.refresh.composition.planned
    factor = trial_on(field, field.known.copy(), learner.parameters).ground.factor
    assert np.array_equal(factor, ground_of(planned, learner.parameters).factor)


def test_what_was_worth_a_look_is_not_cheap_any_more_once_it_is_seen():
    trial = policy_on(np.array([[1.0, 0.1, 0.5, 1.0, 3.0]])).state
    assert np.allclose(trial.ground.factor, [[1.0, 0.1, 0.5, 1.0, 3.0]], atol=1e-3)
    for col in range(5):
        take_in_cell(trial, 0, col, False)
    assert np.allclose(trial.ground.factor, [[1.0, 1.0, 1.0, 1.0, 3.0]], atol=1e-3)


def test_nor_is_it_when_the_field_is_refreshed():
    policy = policy_on(np.full((5, 5), 0.5))
    before = policy.state.ground.factor.copy()
    policy.decide(2, 1, 0, 0, 0.0)
    policy.replace_field(policy.field)
    seen, factor = policy.state.seen, policy.state.ground.factor
    assert seen.sum() == 9
    assert (before[seen] < 1.0).all()
    assert (factor[seen] == 1.0).all()
    assert np.array_equal(factor[~seen], before[~seen])
