"""Rubber that loses a share of its energy in every cycle: Maxwell branches beside the spring of a bushing.

A branch is a spring k and a damper k T in series. Its moment s follows the rate r of its joint by ``s' = k r - s / T``;
over a step the rate is constant, so that

    s(t) = k T r + (s_0 - k T r) e^(-t / T)

is exact, and with it the energy ``s^2 / 2 k`` stored and the energy that is lost, the integral of ``s^2 / k T``.
Which branches give a loss factor that hardly depends on the frequency is said in `parameters.laws`.
"""

from math import exp

from trackdyn.jit import kernel
from trackdyn.model.constants import Model
from trackdyn.model.state import State
from trackdyn.model.work import Work


@kernel
def add_moments(state: State, work: Work, step, branches):
    """Moments of the branches into ``work.torque``: as they are, or at the end of a step of ``step`` seconds.

    The latter takes the rates as they are; what the step adds to them is left to the sweep (`added_damping`).
    ``branches`` is ``model.branches``.
    """
    for b in range(branches.time.shape[0]):
        kept = exp(-step / branches.time[b])
        gain = branches.stiffness[b] * branches.time[b] * (1.0 - kept)
        for i in range(state.branch.shape[1]):
            work.torque[i] -= kept * state.branch[b, i] + gain * work.joint_rate[i]


@kernel
def added_damping(step, branches):
    """Sum of the moments at the end of a step for a unit rate over it, N m s/rad."""
    total = 0.0
    for b in range(branches.time.shape[0]):
        total += branches.stiffness[b] * branches.time[b] * (1.0 - exp(-step / branches.time[b]))
    return total


@kernel
def relax(model: Model, state: State, work: Work, row, branches):
    """Moments at the end of the step just taken, its loss into ``state.work_done[row]``, rates to ``joint_rate``."""
    if branches.time.shape[0] == 0:
        return
    rate, lost, last, h = work.joint_rate, work.joint_loss, state.rate.shape[0] - 1, model.step
    for i in range(last):
        rate[i] = state.rate[i + 1] - state.rate[i]
    rate[last] = state.rate[0] - state.rate[last]
    lost[:] = 0.0
    for b in range(branches.time.shape[0]):  # a loss for each joint, so that the loop vectorizes
        k, time = branches.stiffness[b], branches.time[b]
        kept = exp(-h / time)
        squared, mixed, decayed = h / (k * time), 2.0 * (1.0 - kept) / k, (1.0 - kept * kept) / (2.0 * k)
        for i in range(last + 1):
            steady = k * time * rate[i]
            far = state.branch[b, i] - steady
            state.branch[b, i] = steady + kept * far
            lost[i] += steady * (squared * steady + mixed * far) + decayed * far * far
    loss = 0.0
    for i in range(last + 1):
        loss += lost[i]
    state.work_done[row] += loss


@kernel
def add_rates(state: State, work: Work, out, first, row, branches):
    """Rates of the moments behind the seven powers in ``out`` from ``first`` on; what is lost, to that of ``row``."""
    n = state.branch.shape[1]
    for b in range(branches.time.shape[0]):
        k, time = branches.stiffness[b], branches.time[b]
        for i in range(n):
            moment = state.branch[b, i]
            out[first + 7 + b * n + i] = k * work.joint_rate[i] - moment / time
            out[first + row] += moment * moment / (k * time)


@kernel
def stored(state: State, branches):
    """Energy in the springs of the branches, J."""
    total = 0.0
    for b in range(branches.time.shape[0]):
        for i in range(state.branch.shape[1]):
            total += state.branch[b, i] * state.branch[b, i] / (2.0 * branches.stiffness[b])
    return total
