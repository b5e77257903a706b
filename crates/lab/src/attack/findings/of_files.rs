//! What got through readers and command lines once.

use super::{Finding, finding};

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
                "crates/bip/tests/bank/input.rs",
                "hostile_evidence_never_empties_a_bank",
            ),
            (
                "crates/bip/tests/bank/input.rs",
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
                "crates/files/tests/table.rs",
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
