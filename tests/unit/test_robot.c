/* SPDX-License-Identifier: MIT */
/**
 * @file
 * The plant of the whole robot: both profiles, what the parts do and what they cannot, chance, and the documented figures:
 * an hour of active use empties the battery, three hours fill it.
 */
#include "canopy_sim/robot.h"

#include "unity.h"

enum { SECOND = 100, HOUR = 3600 * SECOND, ENOUGH = 60 * SECOND }; /* steps of the profile nao */

static canopy_sim_robot_t robot;

void setUp(void)
{
    canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_NAO, 1);
}

void tearDown(void)
{
}

static void steps(unsigned count, canopy_sim_command_t command)
{
    for (unsigned step = 0; step < count; step++) {
        canopy_sim_robot_step(&robot, &command);
    }
}

/** Steps until the robot is as it should be. @return how many; ENOUGH: it never was. */
static unsigned until_pose(canopy_sim_pose_t pose, canopy_sim_command_t command)
{
    unsigned count = 0;

    while (robot.pose != pose && count < (unsigned)ENOUGH) {
        canopy_sim_robot_step(&robot, &command);
        count++;
    }
    return count;
}

static void begins_as_its_profile_says(void)
{
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_STANDING, robot.pose);
    TEST_ASSERT_EQUAL_INT32(800, robot.nao.power.battery);
    TEST_ASSERT_EQUAL_INT64(3 * CANOPY_SIM_NM_PER_M, robot.nao.power.distance_nm);
    canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_PAPER, 0);
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_ON_BACK, robot.pose);
    TEST_ASSERT_EQUAL_INT32(500, robot.nao.power.battery);
    TEST_ASSERT_EQUAL_UINT32(1000, robot.figures->step_ms);
}

static void an_hour_of_active_use_empties_the_battery(void)
{
    TEST_ASSERT_TRUE(canopy_sim_robot_drain(&robot, 1000));
    steps(HOUR - SECOND, (canopy_sim_command_t){.track_ball = true});
    TEST_ASSERT_GREATER_THAN_INT64(0, robot.energy_uj);
    TEST_ASSERT_EQUAL_INT32(-2250, robot.current_ma); /* 48.6 W of 21.6 V */
    steps(2 * SECOND, (canopy_sim_command_t){.track_ball = true});
    TEST_ASSERT_EQUAL_INT64(0, robot.energy_uj);
    TEST_ASSERT_EQUAL_INT32(0, robot.nao.power.battery);
}

static void ninety_minutes_of_normal_use_empty_it_too(void)
{
    TEST_ASSERT_TRUE(canopy_sim_robot_drain(&robot, 1000));
    steps(HOUR + HOUR / 2 - SECOND, (canopy_sim_command_t){0});
    TEST_ASSERT_GREATER_THAN_INT64(0, robot.energy_uj);
    steps(2 * SECOND, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL_INT64(0, robot.energy_uj);
}

static void three_hours_fill_it(void)
{
    TEST_ASSERT_TRUE(canopy_sim_robot_set_power(&robot, 0, 0));
    steps(3 * HOUR - SECOND, (canopy_sim_command_t){.power = CANOPY_SIM_POWER_CHARGE});
    TEST_ASSERT_TRUE(robot.nao.power.charging);
    TEST_ASSERT_LESS_THAN_INT32(1000, robot.nao.power.battery);
    steps(2 * SECOND, (canopy_sim_command_t){.power = CANOPY_SIM_POWER_CHARGE});
    TEST_ASSERT_FALSE(robot.nao.power.charging);
    TEST_ASSERT_EQUAL_INT32(1000, robot.nao.power.battery);
    TEST_ASSERT_EQUAL_INT32(0, robot.current_ma);
}

static void charging_needs_the_charger_and_its_mains(void)
{
    const canopy_sim_command_t charge = {.power = CANOPY_SIM_POWER_CHARGE};

    steps(1, charge);
    TEST_ASSERT_FALSE(robot.nao.power.charging);
    TEST_ASSERT_FALSE(canopy_sim_robot_is_plugged(&robot));
    TEST_ASSERT_TRUE(canopy_sim_robot_set_power(&robot, 0, 500));
    steps(1, charge);
    TEST_ASSERT_TRUE(robot.nao.power.charging);
    canopy_sim_robot_plug(&robot, false);
    steps(1, charge);
    TEST_ASSERT_FALSE(robot.nao.power.charging);
    canopy_sim_robot_plug(&robot, true);
    steps(1, charge);
    TEST_ASSERT_TRUE(robot.nao.power.charging);
}

static void it_walks_to_the_charger_at_its_speed_and_only_standing(void)
{
    const canopy_sim_command_t drive = {.power = CANOPY_SIM_POWER_DRIVE_TO_CHARGER};

    steps(SECOND, drive);
    TEST_ASSERT_EQUAL_INT64(3 * CANOPY_SIM_NM_PER_M - INT64_C(100) * 1667000, robot.nao.power.distance_nm);
    TEST_ASSERT_TRUE(canopy_sim_robot_set_posture(&robot, 0, 350));
    steps(SECOND, drive);
    TEST_ASSERT_EQUAL_INT64(3 * CANOPY_SIM_NM_PER_M - INT64_C(100) * 1667000, robot.nao.power.distance_nm);
}

static void it_walks_home(void)
{
    steps(10 * SECOND, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_WALK_HOME});
    TEST_ASSERT_EQUAL_INT32(0, robot.nao.posture.head_x_mm);
    TEST_ASSERT_EQUAL_INT64(3 * CANOPY_SIM_NM_PER_M, robot.nao.power.distance_nm);
}

static void changing_posture_takes_its_time_and_shows_none_on_the_way(void)
{
    const canopy_sim_command_t sit = {.legs = CANOPY_SIM_LEGS_SIT_DOWN};
    unsigned moving = 0;

    canopy_sim_robot_step(&robot, &sit);
    while (robot.pose == CANOPY_SIM_IS_MOVING) {
        TEST_ASSERT_GREATER_OR_EQUAL_INT32(CANOPY_SIM_STANDING_MM, robot.nao.posture.head_height_mm);
        canopy_sim_robot_step(&robot, &(canopy_sim_command_t){0}); /* it goes on by itself */
        moving++;
    }
    TEST_ASSERT_EQUAL_UINT(2 * SECOND, moving);
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_SITTING, robot.pose);
    TEST_ASSERT_EQUAL_UINT(2 * SECOND + 1,
                           until_pose(CANOPY_SIM_IS_ON_BACK, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_LIE_DOWN}));
    TEST_ASSERT_LESS_THAN_INT32(CANOPY_SIM_SITTING_MM, robot.nao.posture.head_height_mm);
}

/** Of many times that it stands up: all take 2 to 5 s, and about a tenth fails. */
static void standing_up_takes_2_to_5_s_and_fails_now_and_then(void)
{
    unsigned falls = 0;
    unsigned shortest = ENOUGH;
    unsigned longest = 0;

    for (uint32_t seed = 1; seed <= 1000u; seed++) {
        unsigned count = 0;

        canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_NAO, seed * UINT32_C(2654435761));
        TEST_ASSERT_TRUE(canopy_sim_robot_set_posture(&robot, 0, 350));
        canopy_sim_robot_step(&robot, &(canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_STAND_UP});
        while (robot.pose == CANOPY_SIM_IS_MOVING) {
            TEST_ASSERT_LESS_THAN_INT32(CANOPY_SIM_STANDING_MM, robot.nao.posture.head_height_mm);
            steps(1, (canopy_sim_command_t){0});
            count++;
        }
        shortest = count < shortest ? count : shortest;
        longest = count > longest ? count : longest;
        falls += robot.falls;
        TEST_ASSERT_EQUAL(robot.falls == 0u, robot.pose == CANOPY_SIM_IS_STANDING);
    }
    TEST_ASSERT_UINT_WITHIN(10, 2 * SECOND, shortest);
    TEST_ASSERT_UINT_WITHIN(10, 5 * SECOND, longest);
    TEST_ASSERT_UINT_WITHIN(40, 100, falls);
}

static void pushed_over_it_lies_and_drops_the_ball(void)
{
    bool back = false;
    bool belly = false;

    robot.hand = CANOPY_SIM_HAND_HOLDS;
    for (unsigned push = 0; push < 20u; push++) {
        canopy_sim_robot_push_over(&robot);
        back = back || robot.pose == CANOPY_SIM_IS_ON_BACK;
        belly = belly || robot.pose == CANOPY_SIM_IS_ON_BELLY;
    }
    TEST_ASSERT_TRUE(back && belly);
    TEST_ASSERT_EQUAL(CANOPY_SIM_HAND_EMPTY, robot.hand);
    TEST_ASSERT_EQUAL_INT32(50, robot.nao.posture.head_height_mm);
    steps(SECOND, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_BACK_OFF});
    TEST_ASSERT_EQUAL_INT64(0, robot.odometer_um); /* it does not walk */
    TEST_ASSERT_NOT_EQUAL(ENOUGH,
                          until_pose(CANOPY_SIM_IS_SITTING, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_SIT_UP}));
}

static void toes_are_free_after_their_time_or_when_it_has_backed_off(void)
{
    canopy_sim_robot_press_toes(&robot, 0xF5, 500);
    TEST_ASSERT_EQUAL_HEX8(5, robot.toes);
    steps(49, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL_HEX8(5, robot.toes);
    steps(1, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL_HEX8(0, robot.toes);

    canopy_sim_robot_press_toes(&robot, 1, 0);
    steps(ENOUGH, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL_HEX8(1, robot.toes);
    steps(149, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_BACK_OFF});
    TEST_ASSERT_EQUAL_HEX8(1, robot.toes);
    steps(1, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_BACK_OFF}); /* 0.25 m */
    TEST_ASSERT_EQUAL_HEX8(0, robot.toes);
    canopy_sim_robot_press_toes(&robot, 0, 0); /* nothing is pressed, so nothing is in the way */
    TEST_ASSERT_EQUAL_INT64(0, robot.obstacle_um);
}

static void wishes_are_counted_and_the_button_goes_on_to_the_next(void)
{
    TEST_ASSERT_FALSE(canopy_sim_robot_say(&robot, CANOPY_SIM_WISH_NOTHING));
    /* NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): out of range is the test's point. */
    TEST_ASSERT_FALSE(canopy_sim_robot_say(&robot, (canopy_sim_wish_t)CANOPY_SIM_WISHES));
    TEST_ASSERT_EQUAL_UINT8(0, robot.wishes);
    TEST_ASSERT_TRUE(canopy_sim_robot_say(&robot, CANOPY_SIM_WISH_SAY_GOODBYE));
    canopy_sim_robot_press_chest(&robot);
    TEST_ASSERT_EQUAL(CANOPY_SIM_WISH_BALL_GAME, robot.wish);
    TEST_ASSERT_TRUE(robot.chest_button);
    steps(1, (canopy_sim_command_t){0});
    TEST_ASSERT_FALSE(robot.chest_button);
    canopy_sim_robot_press_chest(&robot);
    TEST_ASSERT_EQUAL(CANOPY_SIM_WISH_SIT, robot.wish);
    TEST_ASSERT_EQUAL_UINT8(3, robot.wishes);
}

static void an_order_is_carried_out_once_and_forgotten_when_withdrawn(void)
{
    canopy_sim_command_t say = {.say = CANOPY_SIM_SAY_OUCH, .say_number = 7};

    steps(149, say);
    TEST_ASSERT_EQUAL(CANOPY_SIM_ACT_BUSY, robot.speech.state);
    steps(1, say);
    TEST_ASSERT_EQUAL(CANOPY_SIM_ACT_DONE, robot.speech.state);
    TEST_ASSERT_EQUAL_UINT8(7, robot.speech.number);
    steps(ENOUGH, say);
    TEST_ASSERT_EQUAL(CANOPY_SIM_ACT_DONE, robot.speech.state);
    say.say_number = 8; /* another order */
    steps(1, say);
    TEST_ASSERT_EQUAL(CANOPY_SIM_ACT_BUSY, robot.speech.state);
    steps(1, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL(CANOPY_SIM_ACT_IDLE, robot.speech.state);
    TEST_ASSERT_EQUAL_UINT8(8, robot.speech.number);
}

static void the_ball_is_found_reached_grasped_and_thrown(void)
{
    const canopy_sim_command_t go = {.track_ball = true, .legs = CANOPY_SIM_LEGS_APPROACH_BALL};
    const canopy_sim_command_t grasp = {.track_ball = true, .arms = CANOPY_SIM_ARMS_GRASP, .arms_number = 1};
    const canopy_sim_command_t toss = {.track_ball = true, .arms = CANOPY_SIM_ARMS_THROW, .arms_number = 2};
    unsigned count = 0;

    steps(29, go);
    TEST_ASSERT_FALSE(robot.tracked);
    TEST_ASSERT_EQUAL_INT32(1500000, robot.ball_um);
    steps(10 * SECOND, go);
    TEST_ASSERT_TRUE(robot.tracked);
    TEST_ASSERT_EQUAL_INT32(0, robot.ball_um);
    while (robot.hand != CANOPY_SIM_HAND_HOLDS && count < (unsigned)ENOUGH) {
        steps(1, grasp);
        count++;
    }
    TEST_ASSERT_EQUAL_UINT(0, count % (3u * (unsigned)SECOND / 2u)); /* one try, or several */
    steps(SECOND, toss);
    TEST_ASSERT_EQUAL(CANOPY_SIM_HAND_THREW, robot.hand);
    steps(50, toss);
    TEST_ASSERT_EQUAL(CANOPY_SIM_HAND_EMPTY, robot.hand);
    TEST_ASSERT_INT32_WITHIN(600000, 1400000, robot.ball_um);
    TEST_ASSERT_TRUE(canopy_sim_robot_set_posture(&robot, 0, 350));
    steps(1, go);
    TEST_ASSERT_FALSE(robot.tracked); /* sitting it sees no ball */
}

static void some_grasps_fail(void)
{
    unsigned tries = 0;

    for (uint32_t seed = 1; seed <= 1000u; seed++) {
        canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_NAO, seed * UINT32_C(2654435761));
        TEST_ASSERT_TRUE(canopy_sim_robot_set_ball(&robot, 100));
        while (robot.hand != CANOPY_SIM_HAND_HOLDS) {
            steps(3 * SECOND / 2, (canopy_sim_command_t){.arms = CANOPY_SIM_ARMS_GRASP, .arms_number = 1});
            tries++;
        }
    }
    TEST_ASSERT_UINT_WITHIN(60, 1250, tries); /* 4 of 5 succeed */
}

static void what_cannot_be_is_refused(void)
{
    TEST_ASSERT_FALSE(canopy_sim_robot_set_power(&robot, 0, -1));
    TEST_ASSERT_FALSE(canopy_sim_robot_drain(&robot, 1001));
    TEST_ASSERT_FALSE(canopy_sim_robot_set_posture(&robot, 0, -1));
    TEST_ASSERT_FALSE(canopy_sim_robot_set_ball(&robot, -1));
    TEST_ASSERT_FALSE(canopy_sim_robot_set_ball(&robot, 5001));
    TEST_ASSERT_EQUAL_INT32(800, robot.nao.power.battery);
    /* NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): a command that is none does nothing. */
    steps(SECOND, (canopy_sim_command_t){.legs = (canopy_sim_legs_t)77});
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_STANDING, robot.pose);
}

static void temperatures_go_where_they_would_stay(void)
{
    canopy_sim_robot_overheat(&robot);
    TEST_ASSERT_EQUAL_INT32(85000, robot.joint_mdeg[CANOPY_SIM_JOINT_LEFT_LEG]);
    steps(2 * HOUR, (canopy_sim_command_t){0});
    TEST_ASSERT_EQUAL_INT32(35000, robot.joint_mdeg[CANOPY_SIM_JOINT_LEFT_LEG]);
    TEST_ASSERT_EQUAL_INT32(25000, robot.battery_mdeg);
}

static void the_papers_steps_are_the_examples(void)
{
    canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_PAPER, 1);
    steps(10, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_SIT_UP});
    TEST_ASSERT_EQUAL_INT32(300, robot.nao.posture.head_height_mm);
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_SITTING, robot.pose);
    TEST_ASSERT_EQUAL_INT32(499, robot.nao.power.battery); /* it did another task for 10 s */
    steps(4, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_STAND_UP});
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_STANDING, robot.pose);
    steps(5, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_WALK_HOME});
    TEST_ASSERT_EQUAL_INT32(0, robot.nao.posture.head_x_mm);
    steps(1, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_SIT_DOWN});
    TEST_ASSERT_EQUAL(CANOPY_SIM_IS_SITTING, robot.pose);
    steps(20, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_LIE_DOWN});
    TEST_ASSERT_EQUAL_INT32(0, robot.nao.posture.head_height_mm);
    steps(10, (canopy_sim_command_t){0}); /* nobody does anything: Example 4's Stop */
    TEST_ASSERT_EQUAL_UINT64(50000, robot.time_ms);
    TEST_ASSERT_EQUAL_INT32(496, robot.nao.power.battery);
}

static void the_papers_charger_can_be_unplugged(void)
{
    canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_PAPER, 1);
    TEST_ASSERT_TRUE(canopy_sim_robot_set_power(&robot, 0, 500));
    steps(10, (canopy_sim_command_t){.power = CANOPY_SIM_POWER_CHARGE});
    TEST_ASSERT_EQUAL_INT32(510, robot.nao.power.battery);
    canopy_sim_robot_plug(&robot, false);
    steps(10, (canopy_sim_command_t){.power = CANOPY_SIM_POWER_CHARGE});
    TEST_ASSERT_EQUAL_INT32(510, robot.nao.power.battery);
}

/** The same calls give the same bits; another seed another story. */
static void a_seed_is_a_story(void)
{
    uint64_t told[3];

    for (unsigned story = 0; story < 3u; story++) {
        uint64_t sum = 0;

        canopy_sim_robot_init(&robot, CANOPY_SIM_PROFILE_NAO, story == 2u ? 2u : 1u);
        for (unsigned turn = 0; turn < 20u; turn++) {
            canopy_sim_robot_push_over(&robot);
            (void)until_pose(CANOPY_SIM_IS_SITTING, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_SIT_UP});
            (void)until_pose(CANOPY_SIM_IS_STANDING, (canopy_sim_command_t){.legs = CANOPY_SIM_LEGS_STAND_UP});
            sum = sum * 31u + robot.time_ms + (uint64_t)robot.pose;
        }
        told[story] = sum;
    }
    TEST_ASSERT_EQUAL_UINT64(told[0], told[1]);
    TEST_ASSERT_NOT_EQUAL_UINT64(told[0], told[2]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(begins_as_its_profile_says);
    RUN_TEST(an_hour_of_active_use_empties_the_battery);
    RUN_TEST(ninety_minutes_of_normal_use_empty_it_too);
    RUN_TEST(three_hours_fill_it);
    RUN_TEST(charging_needs_the_charger_and_its_mains);
    RUN_TEST(it_walks_to_the_charger_at_its_speed_and_only_standing);
    RUN_TEST(it_walks_home);
    RUN_TEST(changing_posture_takes_its_time_and_shows_none_on_the_way);
    RUN_TEST(standing_up_takes_2_to_5_s_and_fails_now_and_then);
    RUN_TEST(pushed_over_it_lies_and_drops_the_ball);
    RUN_TEST(toes_are_free_after_their_time_or_when_it_has_backed_off);
    RUN_TEST(wishes_are_counted_and_the_button_goes_on_to_the_next);
    RUN_TEST(an_order_is_carried_out_once_and_forgotten_when_withdrawn);
    RUN_TEST(the_ball_is_found_reached_grasped_and_thrown);
    RUN_TEST(some_grasps_fail);
    RUN_TEST(what_cannot_be_is_refused);
    RUN_TEST(temperatures_go_where_they_would_stay);
    RUN_TEST(the_papers_steps_are_the_examples);
    RUN_TEST(the_papers_charger_can_be_unplugged);
    RUN_TEST(a_seed_is_a_story);
    return UNITY_END();
}
