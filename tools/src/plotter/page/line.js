// What is drawn of a line. A line has a `size`, and of each of its points `time(index)` in seconds and `value(index)`, which
// is NaN where nothing is known.

/** How many points of a line are not later than this. */
export function countUntil(line, time) {
  let low = 0;
  let high = line.size;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (line.time(middle) <= time) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The newest value at a time; NaN if none is known. */
export function valueAt(line, time) {
  const count = countUntil(line, time);
  return count ? line.value(count - 1) : NaN;
}

/** The first, lowest, highest and last point of a stretch, by their numbers in the order of time. */
function kept(line, begin, end) {
  let lowest = begin;
  let highest = begin;
  for (let index = begin + 1; index < end; index++) {
    if (line.value(index) < line.value(lowest)) lowest = index;
    if (line.value(index) > line.value(highest)) highest = index;
  }
  const all = new Set([begin, Math.min(lowest, highest), Math.max(lowest, highest), end - 1]);
  return [...all];
}

/**
 * The points of a line from one time to another, with one more on each side, as `[times, values]`. Of each `step` seconds
 * there are four at most, which look like all. What is unknown is `null`.
 */
export function drawn(line, from, to, step) {
  const times = [];
  const values = [];
  const end = Math.min(line.size, countUntil(line, to) + 1);
  let index = Math.max(0, countUntil(line, from) - 1);
  while (index < end) {
    // The same steps for each picture, so that nothing flickers while the line moves.
    const number = Math.floor(line.time(index) / step);
    const last = (number + 1) * step;
    let next = index + 1;
    if (!Number.isNaN(line.value(index))) while (next < end && line.time(next) < last && !Number.isNaN(line.value(next))) next += 1;
    for (const [place, one] of kept(line, index, next).entries()) {
      const value = line.value(one);
      // Lines whose points have the same times are drawn faster, and within a step nobody sees the difference.
      times.push(next - index > 1 ? (number + place / 4) * step : line.time(one));
      values.push(Number.isNaN(value) ? null : value);
    }
    index = next;
  }
  return [times, values];
}
