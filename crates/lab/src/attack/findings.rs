//! What got through once, and the tests that hold it: an attack that succeeded stays a test of its own.

use hwall_testkit::MarkdownTable;

/// A class of inputs or faults that was not held once.
pub struct Finding {
    /// Its short name.
    pub id: &'static str,
    /// What happened.
    pub what: &'static str,
    /// Tests that fail without the mending: file, and name in it.
    pub tests: &'static [(&'static str, &'static str)],
}

const fn finding(
    id: &'static str,
    what: &'static str,
    tests: &'static [(&'static str, &'static str)],
) -> Finding {
    Finding { id, what, tests }
}

const LOOP: &str = "crates/hwall/tests/loop_attacks.rs";
const BRAKING: &str = "crates/haptics/tests/supervisor_braking.rs";
const LIMITS: &str = "crates/haptics/tests/supervisor_limits.rs";
const SCENE: &str = "crates/scene/tests/attacks.rs";
const HAND: &str = "crates/hand/tests/attacks.rs";
const BIP_FILE: &str = "crates/bip/tests/file.rs";
const EXACT: &str = "crates/reachability/tests/exact.rs";
const FORGED: &str = "crates/reachability/tests/forged_map.rs";
const TEXT: &str = "crates/kinematics/tests/urdf_text.rs";
const CALIBRATION: &str = "crates/texton/tests/calibration.rs";
const ROUGHNESS: &str = "crates/texton/tests/roughness.rs";
const TAILS: &str = "crates/psychophysics/tests/attacks.rs";
const LINES: &str = "tests/tests/command_lines.rs";
const PLAN: &str = "crates/stage/src/input/file_plan.rs";
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
        "what resumes by itself and what needs a person was nobody's choice",
        &[(
            LOOP,
            "what_ends_by_itself_and_what_needs_a_person_is_a_setting",
        )],
    ),
];

/// Of files, numbers and command lines.
pub const OF_FILES: &[Finding] = &[
    finding(
        "F1",
        "an output that is the input lost it",
        &[
            (
                LINES,
                "an_output_that_is_the_input_is_refused_and_nothing_is_lost",
            ),
            (PLAN, "an_output_that_is_an_input_is_refused_by_name"),
        ],
    ),
    finding(
        "F2",
        "runs that were interrupted or failed left half files and destroyed good ones",
        &[
            (LINES, "a_failing_run_leaves_the_good_file"),
            (
                "crates/files/tests/files.rs",
                "a_file_that_is_not_finished_leaves_the_old_one_and_no_trace",
            ),
            (
                "crates/stage/src/input/output.rs",
                "a_table_that_fails_halfway_leaves_the_good_file",
            ),
            (
                "crates/stage/src/report/figure_file.rs",
                "a_figure_that_is_given_up_leaves_the_good_one",
            ),
        ],
    ),
    finding(
        "F3",
        "one late time stamp took all memory, or panicked",
        &[
            (HAND, "a_late_time_stamp_is_not_resampled"),
            (
                "crates/stage/src/setting.rs",
                "one_late_time_stamp_is_named",
            ),
        ],
    ),
    finding(
        "F4",
        "`| head -1` ended with status 2",
        &[
            (LINES, "a_reader_that_goes_away_is_no_error"),
            (LINES, "files_are_written_whoever_reads_what_is_printed"),
        ],
    ),
    finding(
        "F5",
        "readers of EXR bounded pixels, but not channels and layers",
        &[(
            "crates/texton/tests/height_field.rs",
            "a_small_file_cannot_ask_for_much_memory",
        )],
    ),
    finding(
        "F6",
        "one polygon of many corners, and many materials, took quadratic time",
        &[
            (SCENE, "one_polygon_of_many_corners"),
            (SCENE, "many_materials"),
            (SCENE, "many_groups"),
        ],
    ),
    finding(
        "F7",
        "reaches of a long recording took more than linear time",
        &[
            (HAND, "reaches_of_a_long_recording"),
            (HAND, "a_reach_does_not_depend_on_how_the_ends_are_found"),
        ],
    ),
    finding(
        "F8",
        "columns that are ignored took sixty times their memory",
        &[
            (HAND, "a_header_of_a_million_columns_is_refused"),
            (HAND, "trials_share_the_list_of_left_out_columns"),
        ],
    ),
    finding(
        "F9",
        "nested URDF took quadratic time",
        &[
            (TEXT, "deeply_nested_elements_are_refused_at_once"),
            (TEXT, "nesting_cannot_be_hidden"),
        ],
    ),
    finding(
        "F10",
        "a bank panicked when all its hypotheses had scored NaN",
        &[
            (
                "crates/bip/tests/bank.rs",
                "hostile_evidence_never_empties_a_bank",
            ),
            (
                "crates/bip/tests/bank.rs",
                "steps_no_clock_takes_are_refused_before_anything_changes",
            ),
        ],
    ),
    finding(
        "F11",
        "scenes that were accepted gave NaN",
        &[
            (SCENE, "a_sliver_beside_a_far_corner_gives_no_nan"),
            (SCENE, "a_hinge_out_of_this_world_is_refused"),
        ],
    ),
    finding(
        "F12",
        "the closest point of a sliver was wrong by up to 1.56 m",
        &[
            (SCENE, "the_closest_point_of_a_sliver"),
            (
                "crates/scene/src/part/triangle.rs",
                "feet_inside_slivers_of_every_height",
            ),
        ],
    ),
    finding(
        "F13",
        "files with forged digests: negative durations, impossible loads",
        &[
            (
                BIP_FILE,
                "a_forged_file_with_a_negative_duration_is_refused",
            ),
            (BIP_FILE, "each_damage_has_its_error"),
            (FORGED, "loads_that_cannot_be_are_refused"),
            ("crates/arrival/tests/files.rs", "forged_files_do_no_harm"),
        ],
    ),
    finding(
        "F14, F23",
        "numbers without bounds: calibrations, joint limits, waves, mechanics",
        &[
            (CALIBRATION, "a_calibration_of_unbounded_numbers_is_refused"),
            (TEXT, "joint_limits_out_of_this_world_are_refused"),
            (ROUGHNESS, "unbounded_waves_and_speeds_end_in_numbers"),
            (SCENE, "mechanics_that_overflow_are_refused"),
            (EXACT, "lines_out_of_this_world_do_not_panic"),
        ],
    ),
    finding(
        "F16",
        "tails of distributions panicked or did not end",
        &[
            (TAILS, "tails_of_all_sizes_end_as_probabilities_or_nan"),
            (
                TAILS,
                "noncentral_tails_of_all_sizes_end_as_probabilities_or_nan",
            ),
        ],
    ),
    finding(
        "F17",
        "a board of 1e160 m panicked",
        &[(EXACT, "boards_without_end_are_refused")],
    ),
    finding(
        "F18",
        "models trained on plain data could not read their own files",
        &[(BIP_FILE, "every_basis_reads_its_own_file")],
    ),
    finding(
        "F19",
        "`qd2` without `qd1` was passed over",
        &[(LINES, "rates_of_some_joints_only_are_named")],
    ),
    finding(
        "F20",
        "line numbers ignored blank lines and CRLF",
        &[
            (HAND, "line_numbers_with_every_line_end"),
            (
                "crates/stage/src/input/numbers.rs",
                "lines_are_counted_as_an_editor_does",
            ),
            (CALIBRATION, "lines_are_counted_as_an_editor_does"),
            (
                "crates/psychophysics/tests/table.rs",
                "lines_count_as_in_an_editor",
            ),
        ],
    ),
    finding(
        "F21",
        "material libraries were followed out of the folder, into pipes, and again and again",
        &[
            (SCENE, "material_libraries_stay_in_the_folder"),
            (SCENE, "a_material_library_that_is_a_pipe_is_missing"),
            (SCENE, "a_material_library_is_read_once"),
        ],
    ),
    finding(
        "F22",
        "flags had no bounds; a full device ended in a panic",
        &[
            (LINES, "flags_have_bounds"),
            (LINES, "a_full_device_is_an_error_and_no_panic"),
            (LINES, "refusals_name_the_flag_and_the_bound"),
        ],
    ),
    finding(
        "F24",
        "two samples a denormal apart had an infinite speed: an index below zero",
        &[(HAND, "a_step_of_no_length_in_time_is_no_speed")],
    ),
    finding(
        "F25",
        "a trial whose hand is slow by the configuration from its first sample on: an index below zero",
        &[(HAND, "a_hand_that_is_slow_by_the_configuration_has_an_end")],
    ),
    finding(
        "",
        "error lines repeated inputs of 1 MB",
        &[
            (LINES, "long_inputs_are_cut_in_messages"),
            (
                "crates/stage/src/lib.rs",
                "error_lines_keep_the_place_and_the_reason",
            ),
        ],
    ),
    finding(
        "",
        "outputs that cannot be written were named after the run",
        &[
            (LINES, "outputs_that_cannot_be_written_are_named_first"),
            (
                PLAN,
                "an_output_that_cannot_be_written_is_named_before_the_work",
            ),
        ],
    ),
];

/// Of a first use: what somebody looked for and did not find, or read and did not understand.
pub const OF_A_FIRST_USE: &[Finding] = &[
    finding(
        "",
        "errors of URDF did not name the two ends; xacro was malformed XML",
        &[
            ("crates/kinematics/tests/urdf.rs", "branches_need_names"),
            ("crates/kinematics/tests/urdf.rs", "a_macro_is_named_as_one"),
        ],
    ),
    finding(
        "",
        "no pose from roll, pitch and yaw, or from a matrix",
        &[
            (
                "crates/geometry/tests/identities.rs",
                "roll_pitch_yaw_turns_about_fixed_axes",
            ),
            (
                "crates/geometry/tests/faults.rs",
                "a_matrix_that_is_not_homogeneous_is_named",
            ),
        ],
    ),
    finding(
        "",
        "parameters of S-R-S arms only by hand, and not from URDF",
        &[
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "parameters_need_no_torques_and_no_tool",
            ),
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "the_presets_come_back",
            ),
            (
                "crates/kinematics/tests/srs_from_chain.rs",
                "what_is_no_such_arm_says_which_joint",
            ),
        ],
    ),
    finding(
        "",
        "reachability of vertical walls only",
        &[
            (
                "crates/reachability/tests/plane.rs",
                "a_ramp_is_looked_up_by_lines",
            ),
            (
                "crates/reachability/tests/plane.rs",
                "outside_their_bands_lines_are_never_wrong",
            ),
        ],
    ),
    finding(
        "",
        "single lines, but no maps, for arms without a closed form",
        &[(
            "crates/reachability/tests/optimization.rs",
            "a_map_of_walls_for_any_chain",
        )],
    ),
    finding(
        "",
        "from a scene to its walls in many calls",
        &[(
            "tests/tests/maps.rs",
            "the_maps_of_a_room_say_what_the_board_can_do",
        )],
    ),
    finding(
        "",
        "no texture for a wanted roughness",
        &[
            (
                "crates/texton/tests/design.rs",
                "what_is_designed_is_predicted",
            ),
            (
                "crates/texton/tests/design.rs",
                "what_is_out_of_reach_names_the_nearest",
            ),
        ],
    ),
    finding(
        "",
        "studies in wide tables, with semicolons, between subjects only, or with gaps were refused",
        &[
            (
                BETWEEN,
                "semicolons_tabs_and_wide_tables_are_the_same_study",
            ),
            (BETWEEN, "groups_alone_are_a_one_way_analysis"),
            (BETWEEN, "incomplete_subjects_are_left_out_and_named"),
        ],
    ),
    finding(
        "",
        "trials that came to nothing were analysed with the others; pairs did not name their error; intervals without their estimate",
        &[
            (BETWEEN, "rows_that_are_not_valid_are_left_out_and_counted"),
            (LINES, "tables_of_studies_are_analysed_as_they_are_written"),
            (BETWEEN, "pairs_name_the_error_that_they_are_tested_against"),
            (
                BETWEEN,
                "intervals_hold_the_estimate_that_is_printed_beside_them",
            ),
        ],
    ),
    finding(
        "",
        "the calibrated prediction was hard to find",
        &[(
            "crates/bip/tests/evaluation.rs",
            "held_out_motions_are_predicted_and_intervals_hold",
        )],
    ),
    finding(
        "",
        "a made-up hand, and a recording of several trials, gave no hint how to go on",
        &[
            (
                "tests/tests/bad_files.rs",
                "a_made_up_hand_is_told_of_its_flag_at_once",
            ),
            (
                "crates/stage/src/input/trial.rs",
                "one_of_several_trials_is_chosen_by_its_name",
            ),
        ],
    ),
    finding(
        "",
        "`contact_study` wrote two studies to the same files",
        &[
            (
                "tests/tests/contact_study_files.rs",
                "studies_of_like_names_write_their_own_files",
            ),
            (
                "crates/lab/src/contact/recordings.rs",
                "no_two_studies_write_the_same_files",
            ),
        ],
    ),
    finding(
        "",
        "`base_placement` found bases in the walls, left out surfaces silently, ignored flags",
        &[
            (
                "crates/lab/src/reach/placement.rs",
                "a_house_needs_a_place_in_it_and_a_room_does_not",
            ),
            (
                "crates/lab/src/reach/placement.rs",
                "surfaces_without_targets_are_named_unless_they_were_left_out_on_purpose",
            ),
            (LINES, "the_base_stands_behind_the_walls_it_serves"),
        ],
    ),
    finding(
        "",
        "one verdict about printing said yes where every printer said no",
        &[(
            "crates/lab/src/texture/patch.rs",
            "there_is_one_verdict_about_printing",
        )],
    ),
    finding(
        "",
        "reasons were told in the words of the program's source",
        &[
            (
                "crates/bridge/src/server/reply.rs",
                "reasons_are_told_in_words",
            ),
            (
                "crates/haptics/src/safety/words.rs",
                "states_are_told_in_words",
            ),
        ],
    ),
    finding(
        "",
        "packages without licence, feature labels, or links that hold",
        &[(
            "tests/tests/publishing.rs",
            "published_crates_have_what_a_registry_and_its_pages_need",
        )],
    ),
    finding(
        "",
        "legends and labels over each other in figures, greys that cannot be told apart",
        &[
            (
                "tests/tests/figures.rs",
                "no_label_lies_over_another_or_is_cut_off",
            ),
            ("tests/tests/figures.rs", "colours_of_curves_differ"),
            (
                "crates/lab/src/speed/page/multiples.rs",
                "ticks_leave_room_for_their_words",
            ),
        ],
    ),
    finding(
        "",
        "tables that their programs no longer write",
        &[
            (
                "tests/tests/documents.rs",
                "every_kind_of_person_is_in_the_table_of_times",
            ),
            ("tests/tests/documents.rs", "every_fault_is_in_the_matrix"),
            (
                "tests/tests/documents.rs",
                "what_is_felt_has_the_columns_of_its_program",
            ),
            (
                "tests/tests/documents.rs",
                "the_readme_quotes_the_speeds_at_hand",
            ),
            (
                "tests/tests/documents.rs",
                "findings_are_held_by_tests_that_there_are",
            ),
        ],
    ),
];

const BETWEEN: &str = "crates/psychophysics/tests/between_and_missing.rs";

/// All of them.
pub fn all() -> impl Iterator<Item = &'static Finding> {
    [OF_THE_LOOP, OF_FILES, OF_A_FIRST_USE]
        .into_iter()
        .flatten()
}

/// The three tables with their headings, as they stand in the document.
#[must_use]
pub fn section() -> String {
    let mut text = "## What got through once\n\nEach line is a class that was not held, and the tests that fail without its mending.\n".to_owned();
    for (heading, findings) in [
        ("The control loop", OF_THE_LOOP),
        ("Files, numbers and command lines", OF_FILES),
        ("First use", OF_A_FIRST_USE),
    ] {
        let mut table = MarkdownTable::new(["", "what happened", "held by"]);
        for finding in findings {
            let tests = finding
                .tests
                .iter()
                .map(|(file, name)| format!("`{name}` ({file})"));
            table.row([
                finding.id.to_owned(),
                finding.what.to_owned(),
                tests.collect::<Vec<_>>().join(", "),
            ]);
        }
        text += &format!("\n### {heading}\n\n{table}");
    }
    text
}
