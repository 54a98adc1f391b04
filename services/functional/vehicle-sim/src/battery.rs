//! The battery: drained by power, its voltage sags under current, its own losses warm it.

use domain::quantity::Positive;

use crate::config;

/// The state of the pack.
#[derive(Debug, Clone)]
pub(crate) struct Battery {
    config: config::Battery,
    remaining: f64,
    current_a: f64,
    temperature_c: f64,
    /// The motors take this many times what they should.
    pub(crate) drain: f64,
    /// Its own electronics report a fault.
    pub(crate) faulty: bool,
}

impl Battery {
    /// Full, at the temperature of the air.
    pub(crate) fn new(config: config::Battery) -> Battery {
        let current_a = config.idle_w.get() / (f64::from(config.cells.get()) * config.cell_full_v.get());
        let temperature_c = config.ambient_c.get();
        Battery { remaining: 1.0, current_a, temperature_c, drain: 1.0, faulty: false, config }
    }

    /// Charge left, 0 to 1.
    pub(crate) fn remaining(&self) -> f64 {
        self.remaining
    }

    /// At the terminals, under the present current.
    pub(crate) fn voltage_v(&self) -> f64 {
        self.open_circuit_v() - self.current_a * self.config.resistance_ohm.get()
    }

    /// Drawn at present.
    pub(crate) fn current_a(&self) -> f64 {
        self.current_a
    }

    /// Of the cells.
    pub(crate) fn temperature_c(&self) -> f64 {
        self.temperature_c
    }

    /// Sets the charge left, 0 to 1: a cell has failed, or the reading was wrong.
    pub(crate) fn set_remaining(&mut self, remaining: f64) {
        self.remaining = remaining.clamp(0.0, 1.0);
    }

    /// Sets the temperature of the cells: one of them is damaged, or the sun has warmed them.
    pub(crate) fn set_temperature_c(&mut self, temperature_c: f64) {
        self.temperature_c = temperature_c;
    }

    /// Whether the autopilot reports a failure.
    pub(crate) fn is_critical(&self) -> bool {
        self.faulty || self.remaining <= self.config.critical.get()
    }

    /// Whether the autopilot lands.
    pub(crate) fn is_emergency(&self) -> bool {
        self.remaining <= self.config.emergency.get()
    }

    /// Whether it no longer gives power.
    pub(crate) fn is_empty(&self) -> bool {
        self.remaining <= 0.0
    }

    /// Power in flight: the induced power grows with the load to the power 3/2 (momentum theory),
    /// pushing through the air comes on top.
    pub(crate) fn flight_power_w(&self, load: f64, drag_w: f64) -> f64 {
        self.config.idle_w.get() + self.drain * (self.config.hover_w.get() * load * load.sqrt() + drag_w)
    }

    /// Power with the motors still.
    pub(crate) fn idle_power_w(&self) -> f64 {
        self.config.idle_w.get()
    }

    /// How many times what they should the cells give to hover: the losses grow with the square of the current.
    pub(crate) fn strain(&self) -> f64 {
        let hover_w = self.config.hover_w.get();
        self.current_for_a(self.drain * hover_w) / self.current_for_a(hover_w)
    }

    /// Gives `power_w` for `dt_s`.
    pub(crate) fn step(&mut self, power_w: f64, dt_s: f64) {
        if self.is_empty() {
            self.current_a = 0.0;
        } else {
            self.current_a = self.current_for_a(power_w);
            let used_j = self.open_circuit_v() * self.current_a * dt_s;
            self.remaining = (self.remaining - used_j / joules(self.config.capacity_wh)).max(0.0);
        }
        self.warm(dt_s);
    }

    /// The current under which the terminals give `power_w`, from I (V0 - I R) = P. No pack gives more than V0^2 / 4 R, at half of its
    /// open-circuit voltage: a demand for more gets that.
    fn current_for_a(&self, power_w: f64) -> f64 {
        let (open_v, resistance_ohm) = (self.open_circuit_v(), self.config.resistance_ohm.get());
        let discriminant = open_v * open_v - 4.0 * resistance_ohm * power_w;
        (open_v - discriminant.max(0.0).sqrt()) / (2.0 * resistance_ohm)
    }

    fn warm(&mut self, dt_s: f64) {
        let loss_w = self.current_a * self.current_a * self.config.resistance_ohm.get();
        let at_rest_c = self.config.ambient_c.get() + loss_w / self.config.cooling_w_k.get();
        let tau_s = self.config.heat_capacity_j_k.get() / self.config.cooling_w_k.get();
        self.temperature_c += (at_rest_c - self.temperature_c) * dt_s / (tau_s + dt_s);
    }

    fn open_circuit_v(&self) -> f64 {
        let (empty, full) = (self.config.cell_empty_v.get(), self.config.cell_full_v.get());
        f64::from(self.config.cells.get()) * (empty + (full - empty) * self.remaining)
    }
}

fn joules(capacity_wh: Positive) -> f64 {
    capacity_wh.get() * 3600.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::shipped;

    #[test]
    fn a_full_battery_lasts_for_25_minutes_of_hovering() {
        let mut battery = Battery::new(shipped::config().battery);
        let (mut time_s, mut last_v) = (0.0, battery.voltage_v());
        while !battery.is_empty() {
            battery.step(battery.flight_power_w(1.0, 0.0), 0.1);
            assert!(time_s == 0.0 || battery.is_empty() || battery.voltage_v() <= last_v);
            last_v = battery.voltage_v();
            time_s += 0.1;
        }
        assert!((24.0 * 60.0..27.0 * 60.0).contains(&time_s), "{time_s}");
        assert!((20.0..40.0).contains(&battery.temperature_c()), "{}", battery.temperature_c());
    }

    #[test]
    fn cells_that_are_hot_cool_down_slowly() {
        let mut battery = Battery::new(shipped::config().battery);
        battery.set_temperature_c(70.0);
        battery.step(battery.idle_power_w(), 1.0);
        let after_a_second_c = battery.temperature_c();
        assert!((69.5..70.0).contains(&after_a_second_c), "{after_a_second_c}");
        for _ in 0..3600 {
            battery.step(battery.idle_power_w(), 1.0);
        }
        assert!(battery.temperature_c() < 30.0, "{}", battery.temperature_c());
    }

    #[test]
    fn the_voltage_sags_under_load_and_recovers() {
        let mut battery = Battery::new(shipped::config().battery);
        let rest_v = battery.voltage_v();
        battery.step(battery.flight_power_w(1.0, 0.0), 0.1);
        assert!(rest_v - battery.voltage_v() > 0.5);
        battery.step(battery.idle_power_w(), 0.1);
        assert!(rest_v - battery.voltage_v() < 0.1);
    }

    #[test]
    fn more_current_costs_more_than_its_share() {
        let mut battery = Battery::new(shipped::config().battery);
        assert_eq!(battery.strain(), 1.0);
        battery.drain = 3.0;
        assert!((3.1..6.0).contains(&battery.strain()), "{}", battery.strain());
    }

    #[test]
    fn a_pack_that_is_asked_for_more_than_it_can_give_sags_to_half_of_its_voltage_and_no_lower() {
        for drain in [1.0, 2.0, 4.0, 8.0, 100.0] {
            let mut battery = Battery::new(shipped::config().battery);
            battery.drain = drain;
            while !battery.is_empty() {
                let open_v = battery.open_circuit_v();
                battery.step(battery.flight_power_w(1.3, 200.0), 0.004);
                let (volt, given_w) = (battery.voltage_v(), battery.voltage_v() * battery.current_a());
                // The voltage is that after the step, with a little less charge.
                assert!(battery.is_empty() || open_v / 2.0 - 0.01 <= volt, "{volt} V of {open_v} V, drain {drain}");
                assert!(given_w <= battery.flight_power_w(1.3, 200.0) + 1.0, "{given_w} W, drain {drain}");
            }
        }
    }
}
