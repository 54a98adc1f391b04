//! What `kittiwake certs` writes, and whether routers accept it.

use super::*;
use crate::cli::{Cli, Command};
use bus::crossing::Side;
use bus::link_credentials::REVOKED;
use bus::link_credentials::check;
use clap::Parser;

fn run(folder: &Path, more: &[&str]) -> Result<Vec<PathBuf>, Failure> {
    let folder = folder.to_string_lossy();
    let args = [&["kittiwake", "certs", &folder, "--vehicle", "uav1", "--vehicle", "uav2"], more].concat();
    let Some(Command::Certs(args)) = Cli::parse_from(args).command else { panic!("not `certs`") };
    make(args.folder.as_deref().unwrap(), &args)
}

/// `kittiwake certs revoke` or `renew` with this folder and these further arguments.
fn change(command: &str, folder: &Path, more: &[&str]) -> Result<Vec<PathBuf>, Failure> {
    let folder = folder.to_string_lossy();
    let Some(Command::Certs(args)) =
        Cli::parse_from([&["kittiwake", "certs", command, &folder], more].concat()).command
    else {
        panic!("not `certs`")
    };
    match args.command.unwrap() {
        CertsCommand::Revoke(it) => revoke(&it),
        CertsCommand::Renew(it) => renew(&it),
    }
}

#[test]
fn a_revoked_router_is_refused_until_it_is_renewed() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    run(root, &["--ground-host", "ground.example", "--ground-host", "10.0.0.1", "--ground-host", "2001:db8::1"])
        .unwrap();
    let accepted = |name: &str, side| check(&root.join(name), name, side).map_err(|it| it.to_string());
    for (name, other, side, other_side) in [
        ("uav1-router", "ground-router", Side::Aircraft, Side::Ground),
        ("ground-router", "uav1-router", Side::Ground, Side::Aircraft),
    ] {
        // Twice renewed: all three are revoked together.
        change("renew", root, &[name]).unwrap();
        let former = std::fs::read(root.join(name).join(CERTIFICATE)).unwrap();
        change("renew", root, &[name]).unwrap();
        accepted(name, side).unwrap();
        let lists = change("revoke", root, &[name]).unwrap();
        assert_eq!(lists.len(), 4, "the authority's and three routers': {lists:?}");
        let refusal = accepted(name, side).unwrap_err();
        assert!(refusal.contains("is revoked"), "{refusal}");
        accepted(other, other_side).unwrap();
        change("renew", root, &[name, "--days", "3"]).unwrap();
        accepted(name, side).unwrap();
        change("revoke", root, &[name, "--former"]).unwrap();
        accepted(name, side).unwrap();
        std::fs::write(root.join(name).join("old.pem"), former).unwrap();
        let found = Authority::open(root).unwrap().issued_to(name).unwrap();
        assert_eq!((found.present.is_some(), found.former.len(), found.unusable.len()), (true, 3, 0));
    }
    let hosts = Authority::open(root).unwrap().issued_to("ground-router").unwrap().present.unwrap().hosts;
    let expected = ["ground-router", "localhost", "127.0.0.1", "ground.example", "10.0.0.1", "2001:db8::1"];
    assert_eq!(hosts, expected, "a renewed certificate is for the same hosts");
}

#[test]
fn what_cannot_be_revoked_or_renewed_is_said() {
    #[track_caller]
    fn refused(result: Result<Vec<PathBuf>, Failure>, said: &str) {
        let refusal = result.unwrap_err().to_string();
        assert!(refusal.contains(said), "{refusal}");
    }
    let root = tempfile::tempdir().unwrap();
    refused(change("revoke", root.path(), &["uav1-router"]), "cannot read");
    run(root.path(), &[]).unwrap();
    for name in ["uav9-router", "authority", "../authority", "", "."] {
        refused(change("revoke", root.path(), &[name]), "there are: ground-router, uav1-router, uav2-router");
        refused(change("renew", root.path(), &[name]), "there are: ground-router");
    }
    refused(change("revoke", root.path(), &["uav1-router", "--former"]), "renew it first");
    std::fs::write(root.path().join("authority").join(REVOKED), "garbage").unwrap();
    refused(change("revoke", root.path(), &["uav1-router"]), "holds no revocation list");
}

#[test]
fn a_list_that_cannot_be_written_for_one_router_is_given_to_all_others() {
    /// Revokes uav1 while the lists of the routers `spoiled` cannot be written.
    #[track_caller]
    fn case(spoiled: &[&str], given: &[&str], said: &str) {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        run(root, &[]).unwrap();
        // No file takes the place of a folder, not even for root.
        spoiled.iter().for_each(|it| std::fs::create_dir(root.join(it).join(REVOKED)).unwrap());
        let refusal = change("revoke", root, &["uav1-router"]).unwrap_err().to_string();
        assert!(refusal.contains(said), "expected `{said}`: {refusal}");
        for name in spoiled {
            let file = root.join(name).join(REVOKED);
            assert!(refusal.contains(&format!("cannot write {}: ", file.display())), "{name}: {refusal}");
            std::fs::remove_dir(file).unwrap();
        }
        let list = |name: &str| std::fs::read(root.join(name).join(REVOKED)).unwrap();
        assert!(given.iter().all(|it| list(it) == list("authority")), "{refusal}");
        // What it says to do.
        assert_eq!(change("revoke", root, &["uav1-router"]).unwrap().len(), 4);
        assert!(spoiled.iter().chain(given).all(|it| list(it) == list("authority")));
        let refusal = check(&root.join("uav1-router"), "uav1-router", Side::Aircraft).unwrap_err().to_string();
        assert!(refusal.contains("is revoked"), "{refusal}");
    }
    let (ground, uav1, uav2) = ("ground-router", "uav1-router", "uav2-router");
    case(&[ground], &[uav1, uav2], "routers that have it: uav1-router, uav2-router;");
    case(&[uav1], &[ground, uav2], "routers that have it: ground-router, uav2-router;");
    case(&[ground, uav2], &[uav1], "routers that have it: uav1-router;");
    case(&[ground, uav1, uav2], &[], "routers that have it: none;");
}

#[test]
fn no_router_is_given_a_list_that_the_authority_could_not_keep() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    run(root, &[]).unwrap();
    std::fs::create_dir(root.join("authority").join(REVOKED)).unwrap();
    change("revoke", root, &["uav1-router"]).unwrap_err();
    assert!(!root.join("ground-router").join(REVOKED).exists());
}

/// Makes certificates, renews that of uav1 once, and keeps a copy of its folder, as on the aircraft, elsewhere.
fn flown(root: &Path) -> tempfile::TempDir {
    let aircraft = tempfile::tempdir().unwrap();
    run(root, &[]).unwrap();
    change("renew", root, &["uav1-router"]).unwrap();
    for file in [CERTIFICATE, KEY, AUTHORITY] {
        std::fs::copy(root.join("uav1-router").join(file), aircraft.path().join(file)).unwrap();
    }
    aircraft
}

/// Whether the router whose credentials these are counts as revoked for somebody with the lists in `root`.
#[track_caller]
fn is_revoked(root: &Path, credentials: &Path, name: &str) -> bool {
    std::fs::copy(root.join("authority").join(REVOKED), credentials.join(REVOKED)).unwrap();
    let checked = check(credentials, name, Side::Aircraft).map_err(|it| it.to_string());
    checked.is_err_and(|refusal| refusal.contains("is revoked"))
}

#[test]
fn a_router_is_revoked_whatever_a_killed_command_has_left_behind() {
    #[track_caller]
    fn case(leave: impl FnOnce(&Path), unreadable: usize) {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        let aircraft = flown(root);
        leave(&root.join("authority/issued"));
        let found = Authority::open(root).unwrap().issued_to("uav1-router").unwrap();
        assert_eq!((found.former.len(), found.unreadable.len()), (1, unreadable), "{:?}", found.unreadable);
        assert!(found.unusable.is_empty(), "{:?}", found.unusable);
        change("revoke", root, &["uav1-router"]).unwrap();
        assert!(is_revoked(root, aircraft.path(), "uav1-router"));
        change("renew", root, &["uav1-router"]).unwrap();
        let entries = || std::fs::read_dir(root.join("authority/issued")).unwrap().map(|it| it.unwrap().path());
        assert!(entries().all(|it| it.extension().unwrap() == "pem"), "{:?}", entries().collect::<Vec<_>>());
    }
    case(|_| (), 0);
    case(|issued| std::fs::write(issued.join("uav1-router-0a.pem.part"), "").unwrap(), 0);
    case(|issued| std::fs::write(issued.join("uav2-router-0a.pem.part"), "-----BEGIN CERT").unwrap(), 0);
    case(|issued| std::fs::write(issued.join("uav1-router-0a.pem"), "").unwrap(), 1);
    case(|issued| std::fs::create_dir(issued.join("uav1-router-0a.pem")).unwrap(), 1);
    case(|issued| std::fs::write(issued.join("uav2-router-0a.pem"), "").unwrap(), 0);
}

#[test]
fn a_certificate_whose_copy_cannot_be_read_is_revoked_by_the_serial_number_in_the_name_of_its_file() {
    #[track_caller]
    fn case(spoil: impl Fn(&Path)) {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        let aircraft = flown(root);
        // The aircraft has kept its old files: a renewal never reached it.
        change("renew", root, &["uav1-router"]).unwrap();
        let flown = issued::of_file(&aircraft.path().join(CERTIFICATE)).unwrap().serial;
        spoil(&root.join("authority/issued").join(format!("uav1-router-{}.pem", issued::digits(&flown))));
        change("revoke", root, &["uav1-router", "--former"]).unwrap();
        assert!(is_revoked(root, aircraft.path(), "uav1-router"));
        assert!(!is_revoked(root, &root.join("uav1-router"), "uav1-router"), "its present one is not a former one");
    }
    case(|copy| std::fs::write(copy, "").unwrap());
    case(|copy| std::fs::write(copy, b"\xff\0garbage").unwrap());
    case(|copy| {
        std::fs::remove_file(copy).unwrap();
        std::fs::create_dir(copy).unwrap();
    });
}

#[test]
fn a_router_of_which_only_names_of_copies_are_left_is_revoked_and_not_renewed() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    let aircraft = flown(root);
    std::fs::remove_dir_all(root.join("uav1-router")).unwrap();
    for (path, copy) in issued::copies(&root.join("authority")).unwrap() {
        if copy.unwrap().name == "uav1-router" {
            std::fs::write(path, "").unwrap();
        }
    }
    let refusal = change("renew", root, &["uav1-router"]).unwrap_err().to_string();
    assert!(refusal.ends_with(".pem holds no certificate in PEM form"), "its hosts are not known: {refusal}");
    change("revoke", root, &["uav1-router"]).unwrap();
    assert!(is_revoked(root, aircraft.path(), "uav1-router"));
}

#[test]
fn only_the_name_of_a_copy_says_which_certificate_it_was() {
    let named = |file: &str| issued::named_for(&Path::new("issued").join(file), "uav1-router");
    assert_eq!(named("uav1-router-0aff.pem"), Some(Some(vec![0x0a, 0xff])));
    assert_eq!(named(&format!("uav1-router-{}.pem", "1f".repeat(20))), Some(Some(vec![0x1f; 20])));
    for other in ["uav1-0a.pem", "uav1-router-2-0a.pem", "router-0a.pem", "0a.pem"] {
        assert_eq!(named(other), None, "{other}");
    }
    for none in ["", "0", "0a0", "old", "+f", "0a (1)", "\u{e4}\u{e4}", &"1f".repeat(21)] {
        assert_eq!(named(&format!("uav1-router-{none}.pem")), Some(None), "{none}");
    }
}

#[test]
fn a_router_is_revoked_and_renewed_without_its_folder() {
    #[track_caller]
    fn case(spoil: impl FnOnce(&Path), unusable: usize) {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        let aircraft = flown(root);
        spoil(&root.join("uav1-router"));
        let found = Authority::open(root).unwrap().issued_to("uav1-router").unwrap();
        assert_eq!((found.present, found.former.len(), found.unusable.len()), (None, 2, unusable));
        let refusal = change("revoke", root, &["uav1-router", "--former"]).unwrap_err().to_string();
        assert!(refusal.contains("which certificate `uav1-router` has now is not known"), "{refusal}");
        let refusal = change("revoke", root, &["uav9-router"]).unwrap_err().to_string();
        assert!(refusal.contains("there are: ground-router, uav1-router, uav2-router"), "{refusal}");
        change("revoke", root, &["uav1-router"]).unwrap();
        assert!(is_revoked(root, aircraft.path(), "uav1-router"));
        change("renew", root, &["uav1-router"]).unwrap();
        let folder = root.join("uav1-router");
        check(&folder, "uav1-router", Side::Aircraft).unwrap_or_else(|bad| panic!("{bad}"));
        assert!(folder.join(REVOKED).exists(), "what was revoked before counts for it too");
    }
    case(|folder| std::fs::remove_dir_all(folder).unwrap(), 0);
    case(|folder| std::fs::remove_file(folder.join(CERTIFICATE)).unwrap(), 0);
    case(|folder| std::fs::write(folder.join(CERTIFICATE), "").unwrap(), 1);
}

#[test]
fn a_router_of_which_nothing_can_be_read_is_not_said_to_be_unknown() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    run(root, &[]).unwrap();
    std::fs::remove_dir_all(root.join("authority/issued")).unwrap();
    std::fs::write(root.join("uav1-router").join(CERTIFICATE), "").unwrap();
    let refusal = change("revoke", root, &["uav1-router"]).unwrap_err().to_string();
    assert!(refusal.ends_with("uav1-router/certificate.pem holds no certificate in PEM form"), "{refusal}");
}

#[test]
fn routers_that_are_revoked_at_once_are_all_revoked() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    let vehicles: Vec<String> = (3..=8).map(|number| format!("--vehicle=uav{number}")).collect();
    run(root, &vehicles.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
    let names: Vec<String> = (1..=8).map(|number| format!("uav{number}-router")).collect();
    // None begins before all are ready.
    let start = std::sync::Barrier::new(names.len());
    std::thread::scope(|scope| {
        for name in &names {
            scope.spawn(|| {
                start.wait();
                change("revoke", root, &[name]).unwrap();
            });
        }
    });
    for name in &names {
        assert!(is_revoked(root, &root.join(name), name), "{name}");
    }
}

#[test]
fn each_router_gets_credentials_that_it_may_use() {
    let folder = tempfile::tempdir().unwrap();
    run(folder.path(), &[]).unwrap();
    for (name, side) in
        [("ground-router", Side::Ground), ("uav1-router", Side::Aircraft), ("uav2-router", Side::Aircraft)]
    {
        check(&folder.path().join(name), name, side).unwrap_or_else(|bad| panic!("{bad}"));
    }
    let before = std::fs::read(folder.path().join("uav1-router/key.pem")).unwrap();
    assert!(run(folder.path(), &[]).unwrap_err().to_string().contains("is there already"));
    run(folder.path(), &["--keep"]).unwrap();
    assert_eq!(std::fs::read(folder.path().join("uav1-router/key.pem")).unwrap(), before);
}

#[test]
fn a_set_that_is_not_whole_is_not_kept_and_what_to_do_makes_it_whole() {
    #[track_caller]
    fn case(spoil: impl FnOnce(&Path), wrong: &[&str], renewed: &[&str]) {
        let root = tempfile::tempdir().unwrap();
        let root = root.path();
        run(root, &[]).unwrap();
        spoil(root);
        let refusal = run(root, &["--keep"]).unwrap_err().to_string();
        for wrong in wrong {
            assert!(refusal.contains(wrong), "expected `{wrong}`: {refusal}");
        }
        for name in renewed {
            let command = format!("`kittiwake certs renew {} {name}`", root.display());
            assert!(refusal.contains(&command), "expected `{command}`: {refusal}");
            change("renew", root, &[name]).unwrap();
        }
        if renewed.is_empty() {
            assert!(
                refusal.contains("remove what is in the folders of the authority and of the routers in"),
                "{refusal}"
            );
            for name in ["authority", "ground-router", "uav1-router", "uav2-router"] {
                let _ = std::fs::remove_dir_all(root.join(name));
            }
        }
        run(root, &["--keep"]).unwrap();
        for name in ["uav1-router", "uav2-router"] {
            check(&root.join(name), name, Side::Aircraft).unwrap_or_else(|bad| panic!("{bad}"));
        }
    }
    let empty = |file: &'static str| move |root: &Path| std::fs::write(root.join(file), "").unwrap();
    let gone = |file: &'static str| move |root: &Path| std::fs::remove_file(root.join(file)).unwrap();
    let uav1 = &["uav1-router"];
    case(empty("uav1-router/key.pem"), &["uav1-router/key.pem holds no private key"], uav1);
    case(empty("uav1-router/certificate.pem"), &["uav1-router/certificate.pem holds no certificate"], uav1);
    case(empty("uav1-router/authority.pem"), &["uav1-router/authority.pem holds no certificate"], uav1);
    case(gone("uav1-router/key.pem"), &["cannot read", "uav1-router/key.pem: No such file"], uav1);
    case(|root| std::fs::remove_dir_all(root.join("uav1-router")).unwrap(), &["uav1-router/key.pem: No such"], uav1);
    let zeros = |root: &Path| std::fs::write(root.join("uav1-router/key.pem"), [0; 241]).unwrap();
    case(zeros, &["uav1-router/key.pem holds no private key"], uav1);
    let both = |root: &Path| {
        empty("uav2-router/key.pem")(root);
        gone("uav1-router/certificate.pem")(root);
    };
    case(both, &["uav1-router/certificate.pem: No", "uav2-router/key.pem holds"], &["uav1-router", "uav2-router"]);
    let other = |root: &Path| {
        std::fs::copy(root.join("uav2-router/key.pem"), root.join("uav1-router/key.pem")).unwrap();
    };
    case(other, &["uav1-router/key.pem is not the key to the certificate beside it"], uav1);
    case(empty("authority/key.pem"), &["authority/key.pem holds no private key"], &[]);
    case(gone("authority/certificate.pem"), &["authority/certificate.pem: No such file"], &[]);
    // The first start lost its power before the last router's turn.
    let cut_short = |root: &Path| {
        std::fs::remove_dir_all(root.join("uav2-router")).unwrap();
        let copies = issued::copies(&root.join("authority")).unwrap();
        let of_it = copies.into_iter().find(|(_, copy)| copy.as_ref().unwrap().name == "uav2-router");
        std::fs::remove_file(of_it.unwrap().0).unwrap();
    };
    case(cut_short, &["uav2-router/key.pem: No such file"], &[]);
}

#[test]
fn what_time_does_to_a_set_is_no_reason_not_to_keep_it() {
    let root = tempfile::tempdir().unwrap();
    run(root.path(), &["--days=-1"]).unwrap();
    change("revoke", root.path(), &["uav1-router"]).unwrap();
    run(root.path(), &["--keep"]).unwrap();
}

#[test]
fn of_commands_that_make_a_set_at_once_one_makes_it() {
    let root = tempfile::tempdir().unwrap();
    let root = root.path();
    let start = std::sync::Barrier::new(4);
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                start.wait();
                run(root, &["--keep"]).unwrap();
            });
        }
    });
    assert_eq!(issued::copies(&root.join("authority")).unwrap().len(), 3, "one for each router");
    check(&root.join("uav1-router"), "uav1-router", Side::Aircraft).unwrap_or_else(|bad| panic!("{bad}"));
}

#[test]
fn empty_folders_are_filled() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["authority", "ground-router", "uav1-router", "uav2-router"] {
        std::fs::create_dir(folder.path().join(name)).unwrap();
    }
    run(folder.path(), &["--keep"]).unwrap();
    check(&folder.path().join("uav2-router"), "uav2-router", Side::Aircraft).unwrap_or_else(|bad| panic!("{bad}"));
}

#[test]
fn credentials_that_would_fail_at_the_link_are_refused_at_once() {
    /// Makes credentials, damages them, and expects a refusal.
    #[track_caller]
    fn spoiled(more: &[&str], spoil: impl FnOnce(&Path), said: &str) {
        let folder = tempfile::tempdir().unwrap();
        run(folder.path(), more).unwrap();
        spoil(folder.path());
        let refused = check(&folder.path().join("uav1-router"), "uav1-router", Side::Aircraft).unwrap_err();
        assert!(refused.to_string().contains(said), "{refused}");
    }
    let copy = |from: &'static str, to: &'static str| {
        move |folder: &Path| {
            std::fs::copy(folder.join(from), folder.join(to)).unwrap();
        }
    };
    let text = |file: &'static str| move |folder: &Path| std::fs::write(folder.join(file), "nonsense").unwrap();
    spoiled(&[], |folder| std::fs::remove_file(folder.join("uav1-router/key.pem")).unwrap(), "cannot read");
    spoiled(&[], text("uav1-router/certificate.pem"), "holds no certificate");
    spoiled(&[], text("uav1-router/authority.pem"), "holds no certificate");
    spoiled(&[], text("uav1-router/key.pem"), "holds no private key");
    spoiled(&[], copy("uav2-router/key.pem", "uav1-router/key.pem"), "is not the key");
    let other = copy("uav2-router/certificate.pem", "uav1-router/certificate.pem");
    spoiled(&[], other, "is the certificate of `uav2-router`, expected that of `uav1-router`");
    spoiled(&["--days=-1"], |_| (), "is valid from");
    let open = |folder: &Path| {
        use std::os::unix::fs::PermissionsExt;
        let mode = std::fs::Permissions::from_mode(0o644);
        std::fs::set_permissions(folder.join("uav1-router/key.pem"), mode).unwrap();
    };
    spoiled(&[], open, "may be read by others");
    let open_and_other = |folder: &Path| {
        copy("uav2-router/key.pem", "uav1-router/key.pem")(folder);
        open(folder);
    };
    spoiled(&[], open_and_other, "is not the key");
    let foreign = |folder: &Path| {
        let elsewhere = tempfile::tempdir().unwrap();
        run(elsewhere.path(), &[]).unwrap();
        std::fs::copy(elsewhere.path().join("uav1-router/authority.pem"), folder.join("uav1-router/authority.pem"))
            .unwrap();
    };
    spoiled(&[], foreign, "has not signed it");
}
