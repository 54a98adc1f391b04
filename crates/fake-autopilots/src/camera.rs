//! A camera that the autopilot triggers by the distance flown.

/// MAV_CMD_DO_SET_CAM_TRIGG_DIST.
pub(crate) const SET_DISTANCE: u16 = 206;

/// What it has taken, and when it takes the next one.
#[derive(Debug, Default)]
pub(crate) struct Camera {
    /// Over ground; 0: none are taken.
    every_m: f64,
    /// Where the last one was taken, or where it was told to begin.
    last: Option<[f64; 3]>,
    at_once: bool,
    taken: u32,
}

impl Camera {
    /// Obeys the command with these parameters.
    pub(crate) fn set(&mut self, params: &[f32; 7]) {
        *self = Camera { every_m: f64::from(params[0]), last: None, at_once: params[2] == 1.0, taken: self.taken };
    }

    /// The vehicle is here; the number of the picture that is taken, if one is.
    pub(crate) fn moved(&mut self, here: [f64; 3]) -> Option<u32> {
        let is_due = match self.last {
            None => self.at_once,
            Some(last) => self.every_m <= (here[0] - last[0]).hypot(here[1] - last[1]),
        };
        if self.every_m <= 0.0 || (!is_due && self.last.is_some()) {
            return None;
        }
        self.last = Some(here);
        is_due.then(|| {
            self.taken += 1;
            self.taken - 1
        })
    }
}
