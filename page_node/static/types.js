/**
 * What the server tells, frame by frame; `doc/page.md` says more.
 *
 * @typedef {[number, number]} Point [m]
 * @typedef {[number, number, number]} Pose [m], [m], [rad]
 *
 * @typedef {object} Trial
 * @property {number} number 0 before the first.
 * @property {string} state idle, running, paused, ended.
 * @property {string} outcome
 * @property {string} reason
 * @property {string} stop_reason
 * @property {number} steps
 * @property {number} decisions
 * @property {number} reinforcements
 *
 * @typedef {object} Advice What goes on and what to do next.
 * @property {string} code Of `advice.<code>`.
 * @property {Record<string, string | number>} [values]
 * @property {string} [because] A key of a second sentence.
 * @property {string} [details] In a node's own words.
 *
 * @typedef {object} State
 * @property {'state'} type
 * @property {string} task
 * @property {boolean} simulation
 * @property {string} phase Of the learner; empty where there is none.
 * @property {number} seconds Of the drive that is recorded.
 * @property {string} bag
 * @property {Trial} trial
 * @property {number} trials_left
 * @property {number} prototypes -1 where nothing is learnt yet.
 * @property {number | null} basin
 * @property {number | null} fidelity
 * @property {string} held Why the robot is held, of `held.<held>`; empty if it is not.
 * @property {string} problem
 * @property {Pose | null} start
 * @property {Point | null} goal
 * @property {Point[]} teach_here
 * @property {[number, number]} speeds [m/s], [rad/s]
 * @property {string} driver
 * @property {number} revision
 * @property {{learner: boolean, controller: boolean, robot: boolean}} nodes
 * @property {boolean} can_undo
 * @property {number} episodes
 * @property {number} tries_left Tries of a real robot that wait until it is driven back.
 * @property {Advice} advice
 *
 * @typedef {{type: 'robot', stamp: number, x: number, y: number, yaw: number, v: number,
 *   w: number, radius: number}} Robot
 * @typedef {{type: 'sight', rows: number, cols: number, resolution: number, x0: number,
 *   y0: number, cells: number[]}} Sight
 * @typedef {{type: 'trail' | 'trail_more', points: Point[], kind?: string}} Trail
 * @typedef {{type: 'movers', discs: [number, number, number][]}} Movers
 * @typedef {{type: 'field', rows: number, cols: number, resolution: number, origin: Point,
 *   revision: number, angle: Uint8Array, flags: Uint8Array, known: Int8Array}} Field
 * @typedef {{type: 'prototypes', x: Float32Array, y: Float32Array, q: Float32Array,
 *   heading: Int8Array, demonstrated: Uint8Array}} Prototypes
 * @typedef {{type: 'truth', rows: number, cols: number, resolution: number, origin: Point,
 *   occupancy: Int8Array}} Truth
 *
 * @typedef {{success: boolean, message: string, code?: string,
 *   values?: Record<string, string | number>}} Answer
 */

/** What is known before the first word of the server. @type {State} */
export const UNKNOWN_STATE = {
  type: 'state', task: '', simulation: false, phase: '', seconds: 0, bag: '',
  trial: {number: 0, state: 'idle', outcome: '', reason: '', stop_reason: '', steps: 0,
    decisions: 0, reinforcements: 0},
  trials_left: 0, prototypes: -1, basin: null, fidelity: null, held: '', problem: '',
  start: null, goal: null, teach_here: [], speeds: [0.2, 1.0], driver: 'nobody', revision: -1,
  nodes: {learner: false, controller: false, robot: false}, can_undo: false, episodes: 0,
  tries_left: 0,
  advice: {code: 'connecting'},
};
