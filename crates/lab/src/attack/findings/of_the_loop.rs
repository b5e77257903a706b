//! What got through the control loop once.

use super::{Finding, finding};

const LOOP: &str = "crates/hwall/tests/loop_attacks.rs";
const BRAKING: &str = "crates/haptics/tests/supervisor_braking.rs";
const LIMITS: &str = "crates/haptics/tests/supervisor_limits.rs";
const APPROACH: &str = "crates/haptics/tests/approach.rs";
const ON_THE_WAY: &str = "crates/haptics/tests/object_on_the_way.rs";
const LOOP_RUNS: &str = "tests/tests/attacks.rs";
const OBEDIENCE: &str = "crates/haptics/tests/obedience.rs";

/// Of the control loop.
pub const OF_THE_LOOP: &[Finding] = &[
    finding(
        "S1",
        "one wrong finite state at the start or after a hold became the command, without limit",
        &[
            (
                LOOP,
                "s1_a_wrong_state_at_the_start_is_no_place_to_begin_from",
            ),
            (LOOP, "s1_a_wrong_state_after_a_hold_is_none_either"),
            (
                LOOP,
                "s1_an_angle_that_stays_where_it_leapt_to_is_not_believed",
            ),
            (
                LOOP,
                "s1_a_velocity_that_is_none_lets_no_leap_of_an_angle_through",
            ),
            (LIMITS, "the_first_command_waits_for_states_that_agree"),
        ],
    ),
    finding(
        "S2",
        "an arm that stood while commands moved went unnoticed, and leapt when it was let go",
        &[
            (
                LOOP,
                "s2_an_arm_that_does_not_move_for_three_seconds_is_noticed_and_does_not_leap",
            ),
            (OBEDIENCE, "positions_that_are_not_followed"),
        ],
    ),
    finding(
        "S3",
        "a slide drove joint 7 into its limit and stopped it in one cycle",
        &[(
            "crates/haptics/tests/slide.rs",
            "random_slides_with_turn_keep_to_the_accelerations_of_the_joints",
        )],
    ),
    finding(
        "S4",
        "after a stall the first command moved up to 0.1 rad in one cycle; so did one that was being cut, and one from an arm \
         measured to be too fast was too fast itself",
        &[
            (LOOP, "s4_after_a_stall_the_first_command_is_no_leap"),
            (BRAKING, "after_a_stall_a_command_that_is_cut_does_not_leap"),
            (
                BRAKING,
                "the_first_command_of_an_arm_that_is_too_fast_is_not",
            ),
        ],
    ),
    finding(
        "S5",
        "torques that no sensor says were a touch; a constant one hid every touch",
        &[
            (LOOP, "s5_torques_that_no_sensor_says_are_no_touch"),
            (
                LOOP,
                "s5_a_bias_of_the_torque_sensors_is_found_at_rest_and_named",
            ),
            (LIMITS, "a_bias_is_found_whatever_else_is_wrong"),
        ],
    ),
    finding(
        "S6",
        "corners of the board came near hands at any speed",
        &[
            (
                LOOP,
                "s6_no_corner_comes_near_a_hand_faster_than_it_can_stop",
            ),
            (LIMITS, "near_a_person_the_board_is_slow"),
        ],
    ),
    finding(
        "",
        "lost commands: the arm fell behind by up to 0.93 rad",
        &[(LOOP, "lost_commands_are_noticed_before_the_arm_is_far_off")],
    ),
    finding(
        "",
        "targets below the table or inside the base",
        &[(
            LIMITS,
            "targets_below_the_table_or_inside_the_base_get_no_command",
        )],
    ),
    finding(
        "",
        "targets that flip every step",
        &[
            (
                LIMITS,
                "a_target_that_flips_every_step_is_noticed_and_one_that_changes_now_and_then_is_not",
            ),
            (
                "crates/haptics/src/safety/watch/target_leaps.rs",
                "flips_that_are_each_a_little_shorter_than_a_leap_are_noticed",
            ),
        ],
    ),
    finding(
        "",
        "at the end of the arm's reach an object under a hand stopped the joints at once",
        &[(
            "crates/haptics/src/render/object/path_follower.rs",
            "where_the_reach_ends_no_joint_stops_at_once",
        )],
    ),
    finding(
        "",
        "behind a surface of which nobody knew the end the board stood for good, its destination before it",
        &[
            (
                "crates/haptics/src/motion/route.rs",
                "only_the_place_left_last_keeps_its_plane_whether_there_is_a_goal_or_not",
            ),
            (
                APPROACH,
                "a_shelf_that_nobody_knows_does_not_keep_the_board_for_good",
            ),
        ],
    ),
    finding(
        "",
        "ways of a board that was almost stopped near a person were looked at every 30 ms of their minutes: a step took without end",
        &[
            (
                "crates/haptics/src/motion/way.rs",
                "slow_ways_are_not_looked_at_more_often_than_others",
            ),
            (
                APPROACH,
                "a_search_that_takes_long_goes_on_in_the_next_steps",
            ),
        ],
    ),
    finding(
        "",
        "a hand that met the board on its way to a door stopped the command in one cycle; the arm went on, and what it did was latched as \
         not obeyed",
        &[
            (
                ON_THE_WAY,
                "a_board_that_is_met_at_speed_brakes_before_it_goes_along_with_the_door",
            ),
            (
                LOOP_RUNS,
                "two_hands_in_a_hurry_that_once_met_a_board_on_its_way_to_a_door",
            ),
        ],
    ),
    finding(
        "",
        "a slight fault after a reset latched the stop again that had been asked for before",
        &[
            (
                LIMITS,
                "a_slight_fault_after_a_reset_does_not_latch_the_stop_again",
            ),
            (LIMITS, "a_stop_on_demand_outlasts_other_faults"),
        ],
    ),
    finding(
        "",
        "what resumes by itself and what needs a person was nobody's choice",
        &[(
            LOOP,
            "what_ends_by_itself_and_what_needs_a_person_is_a_setting",
        )],
    ),
];
