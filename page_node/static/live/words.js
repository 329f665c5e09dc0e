/** What the map shows, in words, for who does not see it. */

/** @typedef {import('../page.js').Page} Page */
/** @typedef {import('../types.js').Robot} Robot */
/** @typedef {import('../types.js').State} State */
/** @typedef {import('../types.js').Sight} Sight */

/** A goal this near is reached, for who only wants to know where it is, [m]. */
const NEAR = 0.3;
const SIDES = ['ahead', 'ahead_left', 'left', 'back_left', 'back', 'back_right', 'right',
  'ahead_right'];

/**
 * Return on which side of the robot a point is.
 *
 * @param {{x: number, y: number, yaw: number}} robot
 * @param {number} x [m]
 * @param {number} y [m]
 * @returns {string} Such as `ahead_left`.
 */
export function sideOf(robot, x, y) {
  const eighth = (Math.atan2(y - robot.y, x - robot.x) - robot.yaw) / (Math.PI / 4);
  return SIDES[((Math.round(eighth) % 8) + 8) % 8] ?? 'ahead';
}

/**
 * Say what is where.
 *
 * @param {Page} page
 * @param {Robot | null} robot
 * @param {Sight | null} sight
 * @returns {string}
 */
export function describe(page, robot, sight) {
  const {t, state} = page;
  if (!robot) {
    return t('live.no_robot');
  }
  const said = [t('live.robot_at', {x: round(robot.x), y: round(robot.y)})];
  const walls = sight ? wallsAround(robot, sight) : [];
  if (walls.length) {
    said.push(t('live.blocked', {where: list(page, walls)}));
  }
  if (state.goal) {
    const [x, y] = state.goal;
    const distance = Math.hypot(x - robot.x, y - robot.y);
    said.push(distance < NEAR ? t('live.at_goal') : t('live.goal_at', {
      distance: round(distance), where: t(`side.${sideOf(robot, x, y)}`)}));
  }
  if (state.basin !== null && state.prototypes > 0) {
    said.push(t('live.basin', {share: page.words.share(state.basin)}));
  }
  return said.join(' ');
}

/** @param {Robot} robot @param {Sight} sight @returns {string[]} Sides with something close. */
function wallsAround(robot, {rows, cols, resolution, x0, y0, cells}) {
  const sides = new Set();
  const reach = 2.2 * resolution + (robot.radius ?? 0);
  for (let index = 0; index < rows * cols; index += 1) {
    const x = x0 + (index % cols + 0.5) * resolution;
    const y = y0 + (Math.floor(index / cols) + 0.5) * resolution;
    if ((cells[index] ?? 0) > 50 && Math.hypot(x - robot.x, y - robot.y) < reach) {
      sides.add(sideOf(robot, x, y));
    }
  }
  return SIDES.filter(side => sides.has(side));
}

/** @param {Page} page @param {string[]} sides @returns {string} */
function list(page, sides) {
  return new Intl.ListFormat(page.words.language).format(
    sides.map(side => page.t(`side.${side}`)));
}

/** @param {number} metres @returns {number} */
function round(metres) {
  return Math.round(metres * 10) / 10;
}
