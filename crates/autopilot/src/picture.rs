//! What a report of a picture says.

/// When a picture was taken, in milliseconds of UTC: as reported, or else when it is heard. `said_us` may count from a start.
pub fn utc_ms(said_us: u64, heard_ms: i64) -> i64 {
    /// An earlier time is not of UTC: 2000-01-01.
    const LEAST_UTC_US: u64 = 946_684_800_000_000;
    if LEAST_UTC_US <= said_us { (said_us / 1000) as i64 } else { heard_ms }
}

/// The angles of a rotation (w, x, y, z); `None` if the numbers are not one.
pub fn roll_pitch_yaw(q: [f64; 4]) -> Option<[f64; 3]> {
    let length = q.iter().map(|it| it * it).sum::<f64>().sqrt();
    let [w, x, y, z] = q.map(|it| it / length);
    ((length - 1.0).abs() < 0.01).then(|| {
        let roll = (2.0 * (w * x + y * z)).atan2(1.0 - 2.0 * (x * x + y * y));
        let pitch = (2.0 * (w * y - z * x)).clamp(-1.0, 1.0).asin();
        let yaw = (2.0 * (w * z + x * y)).atan2(1.0 - 2.0 * (y * y + z * z));
        [roll, pitch, yaw]
    })
}
