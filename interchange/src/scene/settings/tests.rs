#![allow(clippy::unwrap_used)]
use super::*;

const CAMERA: &str = "[camera]\neye = [0, 5, -6.5]\nlook_at = [0, 0.3, 0]\nup = [0, 1, 0]\n\
                      resolution = [128, 96]\nfov_deg = 40\n";

fn parsed(text: &str) -> Settings {
    Located::parse(Path::new("s.toml"), text).unwrap().settings
}

/// The message of a refusal, without the file's name.
fn refusal(text: &str) -> String {
    let message = Located::parse(Path::new("s.toml"), text).unwrap_err().to_string();
    message.strip_prefix("s.toml:").unwrap().to_owned()
}

/// Refusal of the good camera with one line replaced; `key` stands on the returned line.
fn refusal_of(key: &str, line: &str) -> String {
    let lines: Vec<&str> = CAMERA.lines().map(|l| if l.starts_with(key) { line } else { l }).collect();
    refusal(&lines.join("\n"))
}

#[test]
fn integers_are_taken_where_numbers_are_asked() {
    let settings = parsed(CAMERA);
    let expected = CameraSettings {
        name: None,
        eye: [0.0, 5.0, -6.5],
        look_at: [0.0, 0.3, 0.0],
        up: [0.0, 1.0, 0.0],
        resolution: [128, 96],
        focal_length: None,
        film: None,
        fov_deg: Some(40.0),
        projection: ProjectionSettings::Perspective,
        view_height: None,
    };
    assert_eq!(settings.cameras, [expected]);
}

#[test]
fn projections_ask_for_what_they_need() {
    let with = |lines: &str| CAMERA.replace("fov_deg = 40\n", lines);
    let orthographic = parsed(&with("projection = \"orthographic\"\nview_height = 3\n"));
    assert_eq!(orthographic.cameras[0].view_height, Some(3.0));
    let panorama = parsed(&with("projection = \"equirectangular\"\n"));
    assert_eq!(panorama.cameras[0].projection, ProjectionSettings::Equirectangular);
    for (lines, words) in [
        ("projection = \"orthographic\"\n", "view_height is missing"),
        ("projection = \"orthographic\"\nview_height = 0\n", "view_height is 0"),
        ("projection = \"equirectangular\"\nview_height = 1\n", "belongs to an orthographic"),
        ("projection = \"equirectangular\"\nfov_deg = 90\n", "belongs to a perspective"),
        ("fov_deg = 40\nview_height = 1\n", "belongs to an orthographic"),
        ("projection = \"fisheye\"\n", "unknown variant"),
    ] {
        assert!(refusal(&with(lines)).contains(words), "{lines}: {}", refusal(&with(lines)));
    }
}

#[test]
fn nothing_is_required() {
    assert_eq!(parsed(""), Settings::default());
    assert_eq!(parsed("units = \"mm\"\ntwo_sided = []").units.as_deref(), Some("mm"));
}

#[test]
fn several_cameras_keep_their_order_and_need_unique_names() {
    let body = CAMERA.strip_prefix("[camera]\n").unwrap();
    let named = |name: &str| format!("[[camera]]\nname = \"{name}\"\n{body}");
    let settings = parsed(&(named("z") + &named("a")));
    let names: Vec<_> = settings.cameras.iter().map(|camera| camera.name.clone().unwrap()).collect();
    assert_eq!(names, ["z", "a"]);
    assert_eq!(refusal(&(named("z") + &named("z"))), "9: camera name `z` is taken (line 2); choose another");
    let nameless = format!("{}[[camera]]\n{body}", named("z"));
    assert_eq!(refusal(&nameless), "8: there are several cameras; each needs a name");
    assert_eq!(parsed(&format!("[[camera]]\n{body}")).cameras.len(), 1);
}

#[test]
fn unknown_keys_are_refused_with_their_line() {
    assert_eq!(refusal("# cameras\n[camra]\neye = 1"), "2: unknown key `camra`; did you mean `camera`?");
    let strange = "1: unknown key `fog`; expected camera, two_sided or units";
    assert_eq!(refusal("fog = 1"), strange);
    let misspelt = refusal_of("look_at", "lookat = [0, 0, 0]");
    assert_eq!(misspelt, "3: unknown key `lookat` of a camera; did you mean `look_at`?");
    let message = refusal(&format!("{CAMERA}exposure = 2\n"));
    assert!(message.starts_with("7: unknown field `exposure`, expected one of `name`, `eye`"), "{message}");
}

#[test]
fn missing_and_mistyped_values_are_refused_with_their_line() {
    let message = refusal_of("up", "");
    assert!(message.starts_with("1: missing field `up`"), "{message}");
    let message = refusal_of("eye", "eye = [1, 2]");
    assert!(message.starts_with("2: invalid length 2"), "{message}");
    let message = refusal_of("resolution", "resolution = [128, -1]");
    assert!(message.starts_with("5: invalid value: integer `-1`"), "{message}");
    let message = refusal("\n\ntwo_sided = \"leaf\"");
    assert!(message.starts_with("3: invalid type: string"), "{message}");
    let message = refusal("units = \"m\"\ncamera = 3");
    assert!(message.starts_with("2: invalid type: integer `3`"), "{message}");
    let message = refusal("units = \"m\"\n\nunits = \"m\"");
    assert!(message.starts_with("3: duplicate key"), "{message}");
    let message = refusal("\n[camera");
    assert!(message.starts_with("2: "), "{message}");
}

#[test]
fn numbers_that_make_no_picture_are_refused_with_their_line() {
    for (key, line, expected) in [
        ("eye", "eye = [0, nan, 0]", "2: eye is [0.0, NaN, 0.0]; coordinates must be finite numbers"),
        ("up", "up = [0, inf, 0]", "4: up is [0.0, inf, 0.0]; coordinates must be finite numbers"),
        ("look_at", "look_at = [0, 5, -6.5]", "3: look_at and eye are the same point"),
        ("up", "up = [0, 0, 0]", "4: up is zero"),
        ("up", "up = [0, -9.4, 13.0]", "4: up is parallel to the view"),
        ("resolution", "resolution = [0, 5]", "5: resolution has 0, expected 1 to 65536 pixels a side"),
        ("resolution", "resolution = [5, 65537]", "5: resolution has 65537, expected 1 to 65536"),
        ("fov_deg", "fov_deg = 180", "6: fov_deg is 180; it must lie between 0 and 180"),
        ("fov_deg", "fov_deg = nan", "6: fov_deg is NaN"),
        ("fov_deg", "fov_deg = 0", "6: fov_deg is 0"),
        ("fov_deg", "", "1: the camera has no lens; expected either focal_length with film, or fov_deg"),
        ("fov_deg", "focal_length = 0.05", "6: film is missing"),
        ("fov_deg", "film = [1, 1]", "6: focal_length is missing"),
        ("fov_deg", "film = [1, 1]\nfov_deg = 3", "7: fov_deg besides focal_length or film"),
        ("fov_deg", "film = [1, 1]\nfocal_length = 0", "7: focal_length is 0; it must be finite and greater"),
        ("fov_deg", "film = [1, -1]\nfocal_length = 1", "6: film is [1.0, -1.0]; width and height must be"),
    ] {
        let message = refusal_of(key, line);
        assert!(message.starts_with(expected), "{line}: {message}");
    }
}

#[test]
fn directions_are_judged_at_any_scale() {
    for (eye, look_at, up) in [
        (1e-300, 1e-302, "[0, 1e-308, 0]"),
        (1e300, -1e300, "[1e307, 1e308, 0]"),
        (1.7e308, -1.7e308, "[0, 1, 0]"),
    ] {
        let text = CAMERA
            .replace("eye = [0, 5, -6.5]", &format!("eye = [{eye:e}, 0, 0]"))
            .replace("look_at = [0, 0.3, 0]", &format!("look_at = [{look_at:e}, 0, 0]"))
            .replace("up = [0, 1, 0]", &format!("up = {up}"));
        assert_eq!(parsed(&text).cameras.len(), 1);
    }
}

#[test]
fn media_are_refused_until_a_stage_knows_them() {
    let message = refusal("units = \"m\"\n[medium]\nabsorption = 0.1\n");
    assert!(message.starts_with("2: [medium] is not supported yet"), "{message}");
}

#[test]
fn unknown_units_are_refused_with_their_line() {
    assert!(
        refusal("\nunits = \"metres\"").starts_with("2: units `metres` are not known; expected one of m,")
    );
}
