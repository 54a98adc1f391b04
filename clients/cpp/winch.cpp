// The skill `winch_down` of Kittiwake, over zenoh-cpp and zenoh-pico: winch LOCATOR [VEHICLE]
#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <iostream>
#include <mutex>

#include "kittiwake/v1/skill.pb.h"
#include "zenoh.hxx"

namespace kw = kittiwake::v1;
using Clock = std::chrono::steady_clock;
using Seconds = std::chrono::duration<double>;

constexpr double kHaulInM_s = 4.0;  // on an interruption; at most 20 m are out at half of the time of 30 m

int main(int argc, char** argv) try {
    if (argc < 2) return std::cerr << "winch LOCATOR [VEHICLE]\n", 2;
    const std::string base = std::string("kw/") + (argc > 2 ? argv[2] : "uav1") + "/task/";

    auto config = zenoh::Config::create_default();
    config.insert(Z_CONFIG_MODE_KEY, "client");
    config.insert(Z_CONFIG_CONNECT_KEY, argv[1]);
    auto session = zenoh::Session::open(std::move(config));
    auto publisher = session.declare_publisher(zenoh::KeyExpr(base + "report"));

    std::mutex mutex;
    std::condition_variable wake;
    std::deque<kw::TaskOrder> orders;
    auto subscriber = session.declare_subscriber(
        zenoh::KeyExpr(base + "order"),
        [&](const zenoh::Sample& sample) {
            kw::TaskOrder order;
            if (!order.ParseFromString(sample.get_payload().as_string()) || order.skill() != "winch_down") return;
            std::lock_guard lock(mutex);
            orders.push_back(std::move(order));
            wake.notify_one();
        },
        zenoh::closures::none);

    kw::TaskReport report;
    report.set_skill("winch_down");
    report.set_version(1);
    report.set_state(kw::TASK_STATE_READY);
    auto say = [&] { publisher.put(report.SerializeAsString()); };

    double length_m = 0, seconds = 0, out_m = 0;
    Clock::time_point begun, cancelled;  // `cancelled` is the epoch while nothing is to be hauled in
    bool hauling = false;
    kw::TaskOrder next;                  // what takes the place of the running task, once that has ended
    bool has_next = false;

    auto end = [&](const char* outcome, const char* reason) {
        report.set_state(kw::TASK_STATE_ENDED);
        report.set_outcome(outcome);
        report.set_reason(reason);
        hauling = false;
        say();
    };
    auto begin = [&](const kw::TaskOrder& order) {
        report.set_request_id(order.request_id());
        report.set_progress(0);
        report.clear_outcome(), report.clear_reason(), report.clear_results();
        length_m = 0;
        for (const auto& input : order.inputs())
            if (input.name() == "length_m") length_m = input.value();
        if (!(length_m >= 2 && length_m <= 30)) return end("error", "length_m is missing or out of range");
        report.set_state(kw::TASK_STATE_RUNNING);
        seconds = 4 + 2 * length_m;
        begun = Clock::now();
        say();
    };
    auto haul_in = [&](Clock::time_point now) {
        if (hauling) return;
        hauling = true;
        out_m = length_m * std::min(1.0, 2 * report.progress());
        cancelled = now;
    };

    say();
    for (Clock::time_point last = Clock::now();;) {
        std::unique_lock lock(mutex);
        wake.wait_for(lock, std::chrono::milliseconds(100), [&] { return !orders.empty(); });
        auto heard = std::move(orders);
        orders.clear();
        lock.unlock();

        const auto now = Clock::now();
        for (auto& order : heard) {
            const bool running = report.state() == kw::TASK_STATE_RUNNING;
            const bool mine = order.request_id() == report.request_id();
            if (order.cancel()) {
                if (mine && running) haul_in(now);
                if (has_next && order.request_id() == next.request_id()) has_next = false;
            } else if (!mine && running) {
                next = order, has_next = true;
                haul_in(now);
            } else if (!mine) {
                begin(order);
            }
        }
        if (report.state() == kw::TASK_STATE_RUNNING) {
            if (hauling) {
                if (Seconds(now - cancelled).count() >= out_m / kHaulInM_s) end("cancelled", "the rope is in");
            } else {
                report.set_progress(std::min(1.0, Seconds(now - begun).count() / seconds));
                if (report.progress() >= 1) {
                    auto* result = report.add_results();
                    result->set_name("length_m"), result->set_value(length_m);
                    end("delivered", "");
                }
            }
        }
        if (has_next && report.state() == kw::TASK_STATE_ENDED) has_next = false, begin(next);
        if (now - last >= std::chrono::milliseconds(500)) say(), last = now;
    }
} catch (const std::exception& error) {
    return std::cerr << error.what() << "\n", 1;
}
