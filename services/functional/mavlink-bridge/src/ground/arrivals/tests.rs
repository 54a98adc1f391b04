use super::*;

/// The station at this port of 192.0.2.`host`.
fn address(host: u8, port: u16) -> SocketAddr {
    ([192, 0, 2, host], port).into()
}

fn at(seconds: u64) -> Time {
    Time::after(Duration::from_secs(seconds))
}

/// Something that is believed arrives from there and is taken; whether it is listened to.
fn hear(arrivals: &mut Arrivals, from: SocketAddr, now: Time) -> bool {
    arrivals.put(from, b"a frame");
    assert!(arrivals.take().is_some());
    arrivals.admit(true, now)
}

/// Of those who spoke one second after the other, these were listened to each time, and these are sent to in the end.
#[track_caller]
fn check(spoke: &[(u8, u16)], refused: &[(u8, u16)], expected: &[(u8, u16)]) {
    let mut arrivals = Arrivals::of_any();
    for (second, (host, port)) in spoke.iter().enumerate() {
        let is_heard = hear(&mut arrivals, address(*host, *port), at(second as u64));
        assert_eq!(is_heard, !refused.contains(&(*host, *port)), "{host}:{port}");
    }
    let mut present = arrivals.present(at(spoke.len() as u64));
    present.sort();
    assert_eq!(present, expected.iter().map(|it| address(it.0, it.1)).collect::<Vec<_>>());
}

#[test]
fn a_stranger_with_many_ports_displaces_himself() {
    let [a, b, c, d] = [(1, 1), (1, 2), (1, 3), (1, 4)];
    check(&[a, b, c, d], &[], &[a, b, c, d]);
    // Those who were heard last keep their places.
    check(&[a, b, c, d, a, (2, 1)], &[], &[a, c, d, (2, 1)]);
    check(&[a, b, c, d, (2, 1), (1, 5), (1, 6), (1, 7)], &[], &[(1, 5), (1, 6), (1, 7), (2, 1)]);
    // Both have as many: it goes on at its own cost.
    check(&[a, b, (2, 1), (2, 2), (1, 3)], &[], &[b, c, (2, 1), (2, 2)]);
}

#[test]
fn nobody_is_displaced_who_is_the_only_one_of_his_address() {
    let four = [(1, 1), (2, 1), (3, 1), (4, 1)];
    check(&[four[0], four[1], four[2], four[3], (5, 1), (1, 2)], &[(5, 1), (1, 2)], &four);
    let four = [(1, 1), (2, 1), (2, 2), (3, 1)];
    check(&[four[0], four[1], four[2], four[3], (1, 2)], &[(1, 2)], &four);
}

#[test]
fn a_place_is_given_and_kept_by_what_is_believed() {
    let mut arrivals = Arrivals::of_any();
    let (station, stranger) = (address(1, 1), address(2, 1));
    let noise = |arrivals: &mut Arrivals, from, now| {
        arrivals.put(from, b"GET / HTTP/1.1");
        arrivals.take();
        arrivals.admit(false, now)
    };
    assert!(!noise(&mut arrivals, stranger, at(0)) && arrivals.present(at(0)).is_empty());
    assert!(hear(&mut arrivals, station, at(0)));
    assert!(noise(&mut arrivals, station, at(29)), "others may speak there, too");
    assert_eq!((arrivals.present(at(29)), arrivals.present(at(30))), (vec![station], vec![]));
    assert!(!noise(&mut arrivals, station, at(30)));
    assert!(hear(&mut arrivals, station, at(31)));
}

#[test]
fn what_others_send_neither_keeps_out_nor_delays_what_a_station_sends() {
    let mut arrivals = Arrivals::of_any();
    let (station, newcomer) = (address(1, 1), address(3, 1));
    assert!(hear(&mut arrivals, station, at(0)));
    for port in 0..10_000 {
        arrivals.put(address(2, port), b"noise");
    }
    assert!(arrivals.put(station, b"station") && arrivals.put(newcomer, b"newcomer"));
    let taken: Vec<_> = std::iter::from_fn(|| arrivals.take()).collect();
    assert_eq!(taken.len(), 1 + MOST_OF_OTHERS, "a few of the others wait");
    assert!(taken[..2].contains(&b"station".to_vec()), "they are taken in turn");
    assert!(taken.contains(&b"newcomer".to_vec()), "the stranger's address has lost its oldest");
    // A station that floods has a queue of its own, too.
    let number = (0..1_000).filter(|_| arrivals.put(station, b"station")).count();
    assert_eq!(number, MOST_OF_ONE);
    assert!(arrivals.put(newcomer, b"newcomer"));
    assert!((0..2).any(|_| arrivals.take() == Some(b"newcomer".to_vec())));
}

#[test]
fn one_that_is_named_is_the_only_one_and_always_present() {
    let mut arrivals = Arrivals::of_only(address(1, 1));
    assert!(!arrivals.put(address(1, 2), b"a frame") && arrivals.take().is_none());
    assert!(hear(&mut arrivals, address(1, 1), at(0)));
    assert_eq!(arrivals.present(at(1_000)), [address(1, 1)]);
}
