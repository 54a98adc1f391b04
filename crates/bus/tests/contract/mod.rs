//! What a node may rely on, whichever shell it runs on: each story runs over the virtual bus, over zenoh, over zenoh with direct links
//! beside it, and with the nodes of a vehicle in one process.

#![expect(unreachable_pub, reason = "no other crate uses a test: here `pub` means outside of the module")]

mod calls;
mod composed;
mod messages;
mod peers;
mod probe;
mod shell;

/// Makes a test of each story for each shell.
macro_rules! over_each {
    ($($story:path => $name:ident),* $(,)?) => {
        mod over_the_virtual_bus {
            $(#[test] fn $name() { $story(&mut crate::stories::contract::shell::Virtual::new()); })*
        }
        mod over_zenoh {
            $(#[test] fn $name() { $story(&mut crate::stories::contract::shell::Real::start()); })*
        }
        mod over_direct_links {
            $(#[test] fn $name() { $story(&mut crate::stories::contract::shell::Real::linked()); })*
        }
        mod in_one_process {
            $(#[test] fn $name() { $story(&mut crate::stories::contract::composed::Composed::start()); })*
        }
    };
}

over_each! {
    crate::stories::contract::messages::newest_only => of_a_state_a_busy_node_gets_the_newest_for_each_vehicle,
    crate::stories::contract::messages::commands_first => commands_leave_before_what_others_read,
    crate::stories::contract::messages::in_order => events_of_one_sender_keep_their_order,
    crate::stories::contract::calls::one_answer_each => each_request_gets_one_answer_or_the_reason_why_there_is_none,
    crate::stories::contract::calls::server_comes_later => a_request_waits_for_a_node_that_serves_it,
    crate::stories::contract::calls::one_order_at_a_time => of_the_orders_that_people_give_a_node_gets_one_in_each_turn,
    crate::stories::contract::peers::not_lost => who_is_there_is_known_however_full_the_mailbox_is,
}
