use super::*;

/// The station at this port of 192.0.2.`host`.
fn address(host: u8, port: u16) -> SocketAddr {
    ([192, 0, 2, host], port).into()
}

fn at(seconds: u64) -> Time {
    Time::after(Duration::from_secs(seconds))
}

/// Something arrives from there and is taken; whether it is listened to.
fn arrive(arrivals: &mut Arrivals, from: SocketAddr, voice: Voice, now: Time) -> bool {
    arrivals.put(from, b"a frame");
    assert!(arrivals.take().is_some());
    arrivals.admit(voice, now)
}

/// The same of something that is believed.
fn hear(arrivals: &mut Arrivals, from: SocketAddr, now: Time) -> bool {
    arrive(arrivals, from, Voice::Believed, now)
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
    let noise = |arrivals: &mut Arrivals, from, now| arrive(arrivals, from, Voice::Unknown, now);
    assert!(!noise(&mut arrivals, stranger, at(0)) && arrivals.present(at(0)).is_empty());
    assert!(hear(&mut arrivals, station, at(0)));
    assert!(noise(&mut arrivals, station, at(29)), "others may speak there, too");
    assert_eq!((arrivals.present(at(29)), arrivals.present(at(30))), (vec![station], vec![]));
    assert!(!noise(&mut arrivals, station, at(30)));
    assert!(hear(&mut arrivals, station, at(31)));
}

#[test]
fn stations_of_one_address_that_speak_do_not_displace_each_other() {
    let mut arrivals = Arrivals::of_any();
    let five = [1, 2, 3, 4, 5].map(|port| address(1, port));
    for second in 0..60 {
        for station in five {
            assert_eq!(hear(&mut arrivals, station, at(second)), station != five[4], "{station} {second}");
        }
    }
    // The first one is silent, and its place is another's after three seconds.
    for second in 60..62 {
        for station in &five[1..] {
            assert_eq!(hear(&mut arrivals, *station, at(second)), *station != five[4], "{station} {second}");
        }
    }
    assert!(hear(&mut arrivals, five[4], at(62)));
    assert_eq!(arrivals.present(at(62)), five[1..]);
    // One of another address need not wait.
    assert!(hear(&mut arrivals, address(2, 1), at(62)));
}

#[test]
fn who_is_behind_hears_and_is_heard_once_it_is_believed() {
    let mut arrivals = Arrivals::of_any();
    let station = address(1, 1);
    for second in [0, 29, 58] {
        assert!(!arrive(&mut arrivals, station, Voice::Late, at(second)), "it goes no further");
        assert_eq!(arrivals.present(at(second + 29)), [station]);
    }
    assert!(!arrive(&mut arrivals, station, Voice::Unknown, at(59)), "nor does what needs no signature");
    assert!(arrivals.present(at(88)).is_empty(), "nor does that keep its place");
    assert!(!arrive(&mut arrivals, station, Voice::Late, at(90)));
    assert!(hear(&mut arrivals, station, at(91)));
    // From now on what is late may be somebody else's, who repeats it.
    assert!(arrive(&mut arrivals, station, Voice::Late, at(120)));
    assert!(arrivals.present(at(121)).is_empty());
}

#[test]
fn who_is_only_let_in_leaves_first_and_displaces_nobody() {
    let mut arrivals = Arrivals::of_any();
    let behind = [1, 2, 3, 4].map(|host| address(host, 1));
    for (second, station) in behind.into_iter().enumerate() {
        arrive(&mut arrivals, station, Voice::Late, at(second as u64));
    }
    assert_eq!(arrivals.present(at(4)), behind);
    arrive(&mut arrivals, address(5, 1), Voice::Late, at(4));
    assert_eq!(arrivals.present(at(4)), behind, "no place is free");
    // Those who are believed come, to an address that has one as well, and to one that has none.
    let believed = [address(4, 2), address(5, 1), address(5, 2), address(5, 3)];
    for (number, station) in believed.into_iter().enumerate() {
        let now = at(4 + number as u64);
        assert!(hear(&mut arrivals, station, now));
        assert_eq!(arrivals.present(now), [&behind[number + 1..], &believed[..=number]].concat());
    }
    let newcomer = address(5, 4);
    for station in behind.into_iter().chain([newcomer]) {
        arrive(&mut arrivals, station, Voice::Late, at(7));
        assert_eq!(arrivals.present(at(7)), believed, "others keep their places, silent or not");
    }
    // The first one of its own address has been silent for three seconds.
    arrive(&mut arrivals, newcomer, Voice::Late, at(8));
    assert_eq!(arrivals.present(at(8)), [believed[0], believed[2], believed[3], newcomer]);
}

#[test]
fn what_waits_of_a_newcomer_is_taken_before_what_comes_later() {
    let mut arrivals = Arrivals::of_any();
    let (newcomer, other) = (address(1, 1), address(2, 1));
    for (from, bytes) in [(newcomer, b"1"), (newcomer, b"2"), (other, b"x"), (newcomer, b"3")] {
        arrivals.put(from, bytes);
    }
    assert_eq!(arrivals.take().as_deref(), Some(&b"1"[..]));
    assert!(arrivals.admit(Voice::Believed, at(0)));
    arrivals.put(newcomer, b"4");
    let mut taken: Vec<_> = std::iter::from_fn(|| arrivals.take()).collect();
    taken.retain(|it| it != b"x");
    assert_eq!(taken, [b"2", b"3", b"4"]);
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
