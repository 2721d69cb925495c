//! A line of millions of values as one of a few thousand points that looks the same.

/// A value at a time in seconds.
pub(super) type Point = (f64, f64);

/// How many buckets a line has at most. A picture is not wider than this in pixels.
const BUCKETS: usize = 2000;
/// The length of a bucket at first, in seconds.
const FINEST: f64 = 0.005;

/// A line that is thinned while it comes in. Of each bucket, which is a stretch of time, the first, the lowest,
/// the highest and the last value are kept. When there are too many buckets, two become one.
#[derive(Clone, Debug)]
pub(super) struct Thin {
    /// How many buckets there are at most.
    most: usize,
    /// The length of a bucket in seconds.
    width: f64,
    buckets: Vec<Bucket>,
    /// Whether the next value does not belong to the line before it.
    cut: bool,
}

#[derive(Clone, Copy, Debug)]
struct Bucket {
    /// Counted from time 0.
    index: u64,
    first: Point,
    lowest: Point,
    highest: Point,
    last: Point,
    /// Whether the line before this bucket ends there.
    cut: bool,
}

impl Default for Thin {
    fn default() -> Self {
        Self::of(BUCKETS)
    }
}

impl Thin {
    /// A line of so many buckets at most.
    pub(super) fn of(most: usize) -> Self {
        // Shorter than a cycle, so that a short recording is drawn as it is.
        Self { most, width: FINEST, buckets: Vec::new(), cut: true }
    }

    /// The length of a bucket in seconds, 0 if each has one cycle.
    pub(super) fn step(&self) -> f64 {
        if self.width > FINEST {
            self.width
        } else {
            0.0
        }
    }

    /// Adds the next value.
    pub(super) fn add(&mut self, at: f64, value: f64) {
        let point = (at, value);
        let index = (at / self.width) as u64;
        let cut = std::mem::replace(&mut self.cut, false);
        let one = Bucket { index, first: point, lowest: point, highest: point, last: point, cut };
        match self.buckets.last_mut() {
            Some(bucket) if bucket.index == index && !cut => bucket.take(&one),
            _ => self.buckets.push(one),
        }
        if self.buckets.len() > self.most {
            self.join();
            // With room for some more before this is done again, however many cuts there are.
            while self.buckets.len() > self.most / 4 * 3 {
                self.width *= 2.0;
                self.buckets.iter_mut().for_each(|bucket| bucket.index /= 2);
                self.join();
            }
        }
    }

    /// Ends the line. What comes next is not connected with it.
    pub(super) fn cut(&mut self) {
        self.cut = true;
    }

    /// Makes one of the buckets of the same time. A cut within it stays, unless there are more cuts than anybody sees.
    fn join(&mut self) {
        let cuts = self.buckets.iter().filter(|bucket| bucket.cut).count();
        let cuts_stay = cuts <= self.most / 2;
        let mut joined: Vec<Bucket> = Vec::with_capacity(self.most);
        for bucket in self.buckets.drain(..) {
            match joined.last_mut() {
                Some(last) if last.index == bucket.index && !(bucket.cut && cuts_stay) => {
                    last.take(&bucket);
                }
                _ => joined.push(bucket),
            }
        }
        self.buckets = joined;
    }

    /// Whether all values of these lines are the same.
    pub(super) fn are_constant<'a>(lines: impl IntoIterator<Item = &'a Self>) -> bool {
        let buckets = lines.into_iter().flat_map(|line| &line.buckets);
        let mut values = buckets.flat_map(|bucket| [bucket.lowest.1, bucket.highest.1]);
        values.next().is_none_or(|first| values.all(|value| value == first))
    }

    /// The connected lines, without the points in the middle of a level stretch.
    pub(super) fn lines(&self) -> Vec<Vec<Point>> {
        let mut lines: Vec<Vec<Point>> = Vec::new();
        for bucket in &self.buckets {
            if bucket.cut {
                lines.push(Vec::new());
            }
            let Some(line) = lines.last_mut() else { continue };
            bucket.points().into_iter().for_each(|point| add_to(line, point));
        }
        lines
    }
}

impl Bucket {
    /// Takes the values of a later one.
    fn take(&mut self, later: &Self) {
        if later.lowest.1 < self.lowest.1 {
            self.lowest = later.lowest;
        }
        if later.highest.1 > self.highest.1 {
            self.highest = later.highest;
        }
        self.last = later.last;
    }

    /// Its values in the order of time.
    fn points(&self) -> [Point; 4] {
        let mut between = [self.lowest, self.highest];
        if between[0].0 > between[1].0 {
            between.reverse();
        }
        [self.first, between[0], between[1], self.last]
    }
}

/// Adds a point to a line. Of points with the same value in a row, the first and the last stay.
fn add_to(line: &mut Vec<Point>, point: Point) {
    match line[..] {
        [.., last] if last == point => return,
        [.., before, last] if before.1 == last.1 && last.1 == point.1 => drop(line.pop()),
        _ => {}
    }
    line.push(point);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line with a value for each 10 ms.
    fn line(values: impl IntoIterator<Item = f64>) -> Thin {
        let mut thin = Thin::default();
        values.into_iter().enumerate().for_each(|(n, value)| thin.add(n as f64 * 0.01, value));
        thin
    }

    #[test]
    fn a_short_line_stays_as_it_is() {
        let values = [1.0, 3.0, 2.0, 2.5];
        let points: Vec<_> =
            values.iter().enumerate().map(|(n, v)| (n as f64 * 0.01, *v)).collect();
        assert_eq!(line(values).lines(), [points]);
    }

    #[test]
    fn a_level_stretch_is_two_points() {
        let values = [0.0; 50].into_iter().chain([1.0; 50]);
        let lines = line(values).lines();
        assert_eq!(lines, [vec![(0.0, 0.0), (0.49, 0.0), (0.5, 1.0), (0.99, 1.0)]]);
    }

    #[test]
    fn a_night_is_a_few_thousand_points_with_each_peak() {
        let cycles = 10 * 3600 * 100;
        let peaks = [7, 123_456, 3_599_998];
        let night = (0..cycles).map(|cycle| match cycle {
            cycle if peaks.contains(&cycle) => 5000.0,
            cycle => f64::from(cycle % 3),
        });
        let lines = line(night).lines();
        assert_eq!(lines.len(), 1);
        assert!((1000..=4 * BUCKETS).contains(&lines[0].len()), "{}", lines[0].len());
        for peak in peaks {
            let at = f64::from(peak) * 0.01;
            assert!(lines[0].contains(&(at, 5000.0)), "the peak at {at} s is lost");
        }
        assert!(lines[0].is_sorted_by(|one, next| one.0 <= next.0));
        let end = f64::from(cycles - 1) * 0.01;
        assert_eq!((lines[0][0].0, lines[0][lines[0].len() - 1].0), (0.0, end));
    }

    #[test]
    fn a_finer_line_of_an_hour_has_each_peak_and_says_how_much_is_kept() {
        let mut thin = Thin::of(8000);
        assert_eq!(thin.step(), 0.0);
        let peak = 123_456;
        for cycle in 0..360_000 {
            let value = if cycle == peak { 5000.0 } else { f64::from(cycle % 7) };
            thin.add(f64::from(cycle) * 0.01, value);
        }
        let lines = thin.lines();
        assert!((8000..=4 * 8000).contains(&lines[0].len()), "{}", lines[0].len());
        assert!(lines[0].contains(&(f64::from(peak) * 0.01, 5000.0)));
        assert!((thin.step() - 0.64).abs() < 1e-9, "{}", thin.step());
    }

    #[test]
    fn a_cut_separates_lines_even_in_a_long_recording() {
        let mut thin = Thin::default();
        for cycle in 0..1_000_000 {
            if cycle == 500_000 {
                thin.cut();
            }
            thin.add(f64::from(cycle) * 0.01, f64::from(cycle % 7));
        }
        let lines = thin.lines();
        assert_eq!(lines.len(), 2);
        assert_eq!(lines[1][0].0, 5000.0);
        assert!(lines[0].iter().all(|(at, _)| *at < 5000.0));
    }

    #[test]
    fn a_line_of_many_parts_keeps_its_bounds_and_its_steps() {
        let mut thin = Thin::of(400);
        // Half of the time in parts of two values.
        for cycle in 0..200_000 {
            if cycle < 100_000 && cycle % 2 == 0 {
                thin.cut();
            }
            let value = if cycle == 150_001 { 5000.0 } else { f64::from(cycle % 7) };
            thin.add(f64::from(cycle) * 0.01, value);
            assert!(thin.buckets.len() <= 400, "{} at {cycle}", thin.buckets.len());
        }
        assert!(thin.step() < 2000.0 / 400.0 * 8.0, "{}", thin.step());
        let points: Vec<_> = thin.lines().concat();
        assert!((400..=4 * 400).contains(&points.len()), "{}", points.len());
        assert!(points.contains(&(1500.01, 5000.0)));
        assert!(points.is_sorted_by(|one, next| one.0 <= next.0));
    }

    #[test]
    fn a_constant_line_is_known() {
        let (level, other) = (line([4.0; 9]), line([5.0; 9]));
        assert!(Thin::are_constant([&line([])]));
        assert!(Thin::are_constant([&level]) && Thin::are_constant([&level, &level]));
        assert!(!Thin::are_constant([&line([4.0, 4.0, 5.0, 4.0])]));
        assert!(!Thin::are_constant([&level, &other]));
    }
}
