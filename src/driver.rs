//! From a host's frame times to steps of one length.

use crate::error::{Check, Result};

/// A fixed-step accumulator with a bounded backlog.
///
/// Each frame, [`advance`](Self::advance) says how many steps to take and where between the last two states the frame
/// lies. Time that would need more steps than allowed is dropped and counted, so that a slow machine runs slow instead
/// of falling ever further behind.
#[derive(Debug, Clone, PartialEq)]
pub struct FixedStep {
    dt: f64,
    max_steps: u32,
    accumulated: f64,
    asked: f64,
    dropped: f64,
}

/// What to do for one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[must_use]
#[non_exhaustive]
pub struct FrameSteps {
    /// Steps to take now.
    pub steps: u32,
    /// Where the frame lies between the state before the last step (0) and the state after it (1). Draw
    /// `position − (1 − blend) · displacement`.
    pub blend: f64,
}

/// The longest frame, s.
const LONGEST: f64 = 1e9;

impl FixedStep {
    /// For steps of `dt` seconds, at most `max_steps` of them a frame.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) if `dt` is outside 1e-5 … 0.2 s or `max_steps` outside 1 … 1000.
    pub fn new(dt: f64, max_steps: u32) -> Result<Self> {
        let check = Check { path: "" };
        crate::settings::validate_dt(&check, dt)?;
        check.that((1..=1000).contains(&max_steps), "max_steps", max_steps, "1 to 1000")?;
        Ok(FixedStep { dt, max_steps, accumulated: 0.0, asked: 0.0, dropped: 0.0 })
    }

    /// Takes in the time of one frame, s. A frame time that is negative or not finite counts as 0, one of more than
    /// thirty years as that long.
    pub fn advance(&mut self, frame_time: f64) -> FrameSteps {
        let frame_time = if frame_time.is_finite() { frame_time.clamp(0.0, LONGEST) } else { 0.0 };
        self.asked += frame_time;
        self.accumulated += frame_time;
        // A frame that ends a rounding error short of a step counts as having reached it.
        let due = (self.accumulated / self.dt + 1e-9).floor();
        let steps = due.min(f64::from(self.max_steps));
        let rest = (self.accumulated - due * self.dt).max(0.0);
        self.dropped += (due - steps) * self.dt;
        self.accumulated = rest;
        FrameSteps { steps: steps as u32, blend: (rest / self.dt).min(1.0) }
    }

    /// Changes the step's length, s. What has accumulated stays.
    ///
    /// # Errors
    /// [`Error::Invalid`](crate::Error::Invalid) outside 1e-5 … 0.2 s.
    pub fn set_dt(&mut self, dt: f64) -> Result<()> {
        crate::settings::validate_dt(&Check { path: "" }, dt)?;
        self.dt = dt;
        Ok(())
    }

    /// Time dropped because the backlog was full, s.
    pub fn dropped(&self) -> f64 {
        self.dropped
    }

    /// Simulated time over real time since the start: 1 keeps up, below 1 is slow motion.
    pub fn real_time_factor(&self) -> f64 {
        if self.asked > 0.0 { 1.0 - self.dropped / self.asked } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hitch_is_cut_and_counted_and_leaves_no_debt() {
        let mut driver = FixedStep::new(0.01, 10).unwrap();
        assert_eq!(driver.advance(1.0).steps, 10);
        assert!((driver.dropped() - 0.9).abs() < 1e-12);
        assert!((driver.real_time_factor() - 0.1).abs() < 1e-12);
        assert_eq!(driver.advance(0.01).steps, 1);
    }

    #[test]
    fn remainders_carry_over_and_place_the_frame() {
        let mut driver = FixedStep::new(0.01, 10).unwrap();
        let a = driver.advance(0.025);
        assert_eq!(a.steps, 2);
        assert!((a.blend - 0.5).abs() < 1e-9);
        let b = driver.advance(0.005);
        assert_eq!(b.steps, 1);
        assert!(b.blend < 1e-6);
        let total: u32 = (0..6000).map(|_| driver.advance(1.0 / 60.0).steps).sum();
        assert_eq!(total, 10_000);
        assert_eq!(driver.dropped(), 0.0);
    }

    #[test]
    fn bad_frame_times_and_settings_do_no_harm() {
        let mut driver = FixedStep::new(0.01, 10).unwrap();
        for bad in [f64::NAN, f64::INFINITY, -1.0] {
            assert_eq!(driver.advance(bad).steps, 0);
        }
        assert_eq!(driver.advance(f64::MAX).steps, 10);
        assert!((0.0..1e-6).contains(&driver.real_time_factor()));
        assert!(FixedStep::new(0.0, 10).is_err());
        assert!(FixedStep::new(0.01, 0).is_err());
    }
}
