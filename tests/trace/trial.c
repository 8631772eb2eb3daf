/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The trial of the trace: random trees, status histories and values, frames that are lost, and two decoders.
 *
 *     trace_trial [TICKS [SEED [log]]]
 *
 * Nothing wrong may be shown as certain; what changes little is certain; what was lost is known again in time. `log`:
 * writes the frames that came, and what is shown of them, for tests/integration/test_trace_decoders.py:
 *
 *     M hash nodes slots changes_max guard     a controller and a receiver that joins
 *     F message data                           a frame: 0 CanopyTick … 7 CanopyModel
 *     E refused                                the end, and how many frames were refused
 *     S                                        silence: the tick at hand is over
 *     T tick [node=[code[,since,exact]] …]     a tick is shown: what has changed of nodes and, with a v, of slots.
 *                                              Without code: unknown; without since: not certain
 */
#include <inttypes.h>
#include <string.h>
#include <time.h>

#include "check.h"
#include "judge.h"

enum {
    RUN_TICKS = 500,
    STARTS_AFTER = 200, /* more than the channel can lose at once: else a start may look like going on (Limits) */
    DEFAULT_TICKS = 20000
};

static const channel_t channels[] = {
    {.name = "0 %"},
    {.name = "1 %", .of_1000 = 10},
    {.name = "10 %", .of_1000 = 100},
    {.name = "50 %", .of_1000 = 500},
    {.name = "bursts of up to 40", .bursts = 5, .burst_most = 40},
    {.name = "bursts of up to 400", .bursts = 1, .burst_most = 400},
    {.name = "1 %, 2 % damaged", .of_1000 = 10, .damaged = 20},
};
enum { CHANNELS = sizeof channels / sizeof channels[0] };

static controller_t controller;
static judge_t judge;

static controller_mood_t any_mood(random_t *random)
{
    static const uint16_t flips[] = {0, 2, 20, 200, 1000};
    controller_mood_t mood = {.leaf_flips = flips[random_below(random, 5)],
                              .value_flips = flips[random_below(random, 5)]};

    if (random_chance(random, 250)) {
        mood.bus_frames = (uint16_t)(3u + random_below(random, 12));
    }
    return mood;
}

/** One controller, and a receiver that is there from the start or joins. Losses pause, so that all can be known again. */
static void run(const channel_t *channel, uint64_t seed, tally_t *tally, FILE *log)
{
    random_t random = random_seed(seed);
    controller_mood_t mood = any_mood(&random);
    uint32_t number = random_chance(&random, 100) ? UINT32_MAX - random_below(&random, 200) : 0;
    uint32_t joins_at = random_chance(&random, 500) ? 0 : random_below(&random, RUN_TICKS / 4);
    bool is_free = channel == &channels[0];
    const channel_t *now = channel;
    uint64_t shown = tally->shown;

    controller_make(&controller, seed, &mood, 0);
    if (channel->damaged > 0) { /* Crc would refuse what is damaged */
        controller.config.data_id = CANOPY_E2E_NONE;
    }
    controller_start(&controller, number);
    for (uint32_t i = 0; i < joins_at; i++) {
        controller_tick(&controller);
    }
    judge_start(&judge, &controller, channel, seed, tally, log);
    for (uint32_t i = 0; i < RUN_TICKS; i++) {
        if (channel->damaged == 0 && random_chance(&random, is_free ? 0u : now == channel ? 5u : 20u)) {
            now = now == channel ? &channels[0] : channel;
            judge.channel = now;
        }
        if (controller.number >= STARTS_AFTER && controller.number < UINT32_MAX / 2u && random_chance(&random, 5)) {
            controller_start(&controller, 0);
            judge_note_start(&judge);
        }
        controller_tick(&controller);
        judge_tick(&judge);
    }
    judge_end(&judge);
    CHECK(!is_free || mood.bus_frames > 0 || tally->shown == shown + RUN_TICKS);
}

static void print(const channel_t *channel, const tally_t *tally)
{
    double nodes = (double)(tally->nodes_certain + tally->nodes_old + tally->nodes_unknown) / 100.0;
    double slots = (double)(tally->slots_certain + tally->slots_old + tally->slots_unknown) / 100.0;

    fprintf(stderr, "%-20s %9" PRIu64 " %9" PRIu64 " %10" PRIu64 " %9" PRIu64, channel->name, tally->ticks,
            tally->shown, tally->frames, tally->lost);
    if (channel->damaged > 0) {
        fprintf(stderr, "   for the other decoder\n");
        return;
    }
    fprintf(stderr, "   %6.2f %6.2f %6.2f   %6.2f %6.2f %6.2f   %u of %u\n", (double)tally->nodes_certain / nodes,
            (double)tally->nodes_old / nodes, (double)tally->nodes_unknown / nodes,
            (double)tally->slots_certain / slots, (double)tally->slots_old / slots,
            (double)tally->slots_unknown / slots, (unsigned)tally->known_after, (unsigned)tally->promised);
}

int main(int argc, char **argv)
{
    uint64_t ticks = argc > 1 ? strtoull(argv[1], NULL, 10) : DEFAULT_TICKS;
    uint64_t seed = argc > 2 ? strtoull(argv[2], NULL, 10) : (uint64_t)time(NULL);
    FILE *log = argc > 3 ? stdout : NULL;
    uint64_t run_seed = seed << 24; /* no other seed has the same runs */

    fprintf(stderr, "seed %" PRIu64 "\n", seed);
    fprintf(stderr, "%-20s %9s %9s %10s %9s   nodes certain, old, unknown [%%]   values   known after [ticks]\n",
            "lost", "ticks", "shown", "frames", "lost");
    for (unsigned i = 0; i < CHANNELS; i++) {
        tally_t tally = {0};

        for (uint64_t done = 0; done < ticks / CHANNELS; done += RUN_TICKS) {
            run(&channels[i], run_seed++, &tally, log);
        }
        print(&channels[i], &tally);
    }
    CHECK(fflush(stdout) == 0);
    return 0;
}
