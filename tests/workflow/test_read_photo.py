"""The angle of repose is read from pictures whose angle is known, and what is no heap is refused."""

import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import skimage
from campaign import ENVIRONMENT, ROOT
from heap_photos import DARK, GROUND, SIZE, WHITE, Scene, cone_grains, photograph
from matplotlib.colors import to_rgb
from PIL import Image, ImageDraw
from scipy.spatial import ConvexHull

import dem.measure.heap
from dem.measure.heap import silhouette_angle
from virtual_soil.calibration.errors import CalibrationError
from virtual_soil.calibration.noise import student
from virtual_soil.campaign.laboratory.photo.heap import read_heap, seen_slope
from virtual_soil.campaign.laboratory.photo.image import open_photo
from virtual_soil.campaign.laboratory.photo.outline import NoHeap, check_flanks, outline_of
from virtual_soil.campaign.soils import measure_soil
from virtual_soil.report.plots import COLOURS
from virtual_soil.report.read_photo import main, mean_of, read_photos, soil_line

LIGHT = {"wall": (215, 215, 210), "plate": (190, 190, 185)}
#: Name -> a scene and the quality of its JPEG; None: no compression.
SCENES = {
    "bright before dark": (Scene(angle_deg=30.0), None),
    "dark before bright, shadow, tilted": (Scene(angle_deg=38.0, heap=DARK, tilt_deg=3.0, shadow=0.6, **LIGHT), 90),
    "clutter, shadow, tilted back": (Scene(angle_deg=30.0, clutter=14, shadow=0.4, tilt_deg=-3.0), 90),
    "clutter, blurred, noisy, steep": (Scene(angle_deg=45.0, clutter=8, blur=2.5, noise=10.0, half_width=110.0), 80),
    "white before beige, flat": (Scene(angle_deg=20.0, heap=WHITE, wall=(200, 190, 170), shadow=0.5, half_width=180.0), 60),
    "one dark flank": (Scene(angle_deg=30.0, side_light=1.0, tilt_deg=2.0, wall=(150, 130, 100)), 60),
    "large grains": (Scene(angle_deg=38.0, grain_radius=5.0, shadow=0.3, **LIGHT), 90),
    "flat, cluttered, compressed": (Scene(angle_deg=20.0, clutter=6, tilt_deg=-2.0, half_width=150.0), 40),
}


def saved(folder, picture, name="heap.png", **options):
    """Path of a picture: an image, or an array of colours."""
    path = folder / name
    (picture if isinstance(picture, Image.Image) else Image.fromarray(picture)).save(path, **options)
    return path


def canvas_of(*shapes, colour=(225, 225, 220)):
    """A drawing of polygons on a bright ground."""
    picture = Image.new("RGB", SIZE, colour)
    for corners in shapes:
        ImageDraw.Draw(picture).polygon(corners, fill=(80, 60, 40))
    return picture


def triangle_mask(left_deg, right_deg, tilt_deg, height=120.0):
    """Mask of a triangle of known flanks on a ground that rises to the right."""
    y, x = np.mgrid[:360, :640] + 0.5
    t = np.radians(tilt_deg)
    along = (x - 320) * np.cos(t) - (y - 250) * np.sin(t)
    up = -(x - 320) * np.sin(t) - (y - 250) * np.cos(t)
    slope = np.tan(np.radians(np.where(along < 0, left_deg, right_deg)))
    return (up >= 0) & (up <= height - np.abs(along) * slope)


@pytest.mark.parametrize("name", SCENES)
def test_the_true_angle_lies_within_the_stated_uncertainty(name, tmp_path):
    scene, quality = SCENES[name]
    path = saved(tmp_path, photograph(scene), *(("heap.jpg",) if quality else ()), **({"quality": quality} if quality else {}))
    heap = read_heap(path)
    error = heap.angle_deg - scene.angle_deg
    assert abs(error) < 2 * heap.uncertainty_deg
    # beside a bound on both: a reading that is far off, or that says nothing
    assert abs(error) < 0.7
    assert heap.uncertainty_deg < 1.0
    assert heap.outline.ground.tilt_deg == pytest.approx(scene.tilt_deg, abs=0.7)


@pytest.mark.parametrize("angle", [15.0, 30.0, 50.0])
@pytest.mark.parametrize("tilt", [-4.0, 0.0, 2.5])
def test_flanks_of_a_sharp_triangle_are_exact_under_tilt(angle, tilt):
    outline = outline_of(triangle_mask(angle, angle + 4.0, tilt, height=80.0))
    assert outline.ground.tilt_deg == pytest.approx(tilt, abs=0.1)
    assert (outline.left.angle_deg, outline.right.angle_deg) == pytest.approx((angle, angle + 4.0), abs=0.3)
    assert outline.angle_deg == pytest.approx(angle + 2.0, abs=0.2)
    check_flanks(outline)
    turned = outline_of(triangle_mask(angle, angle + 4.0, tilt, height=80.0), outline.ground.turned(2.0))
    assert (turned.left.angle_deg, turned.right.angle_deg) == pytest.approx((angle - 2.0, angle + 6.0), abs=0.4)


@pytest.mark.parametrize("view_deg", [0.0, 50.0])
def test_a_photograph_shows_the_silhouette_that_a_simulation_measures(view_deg, tmp_path, monkeypatch):
    """A heap that is no cone: its flanks are 28 and 34 degrees where they are seen without a turn."""
    scene = Scene(angle_deg=30.0, half_width=130.0)
    grains = cone_grains(scene, np.random.default_rng(3))
    grains[:, 0] *= np.where(grains[:, 0] < 0, 1.08, 0.86)
    c, s = np.cos(np.radians(view_deg)), np.sin(np.radians(view_deg))
    grains[:, :2] = grains[:, :2] @ np.array([[c, -s], [s, c]])
    monkeypatch.setattr(dem.measure.heap, "N_VIEWS", 1)
    silhouette = silhouette_angle(grains[:, :3], grains[:, 3])
    heap = read_heap(saved(tmp_path, photograph(scene, grains)))
    assert heap.angle_deg == pytest.approx(silhouette.angle_deg, abs=0.5)
    # the standard deviation of two flanks is their difference over root 2, with either sign
    assert heap.flanks_deg * np.sqrt(2.0) == pytest.approx(silhouette.azimuth_sd_deg, abs=0.5)
    assert silhouette.azimuth_sd_deg > 3.0 or view_deg > 0.0


def test_a_raised_or_near_camera_sees_less(tmp_path):
    azimuth = np.linspace(0.0, 2.0 * np.pi, 20001)
    slope = np.tan(np.radians(30.0))
    cone = np.vstack([np.column_stack([np.cos(azimuth), np.sin(azimuth), 0 * azimuth]), [0.0, 0.0, slope]])

    def seen(across, up):
        hull = ConvexHull(np.column_stack([across, up]))
        flanks = [pair for pair in hull.simplices if len(cone) - 1 in pair]
        (i, j), _ = flanks
        return np.degrees(np.arctan(abs((up[i] - up[j]) / (across[i] - across[j]))))

    e = np.radians(8.0)
    raised = seen(cone[:, 0], cone[:, 2] * np.cos(e) + cone[:, 1] * np.sin(e))
    near = seen(cone[:, 0] / (6.0 + cone[:, 1]), cone[:, 2] / (6.0 + cone[:, 1]))
    assert seen_slope(30.0, raised_deg=8.0) == pytest.approx(raised, abs=1e-3)
    assert seen_slope(30.0, distance_ratio=6.0) == pytest.approx(near, abs=1e-3)
    assert raised < 29.2
    assert near < 29.7
    assert seen_slope(30.0, raised_deg=40.0) == 0.0


def drawn(kind):
    """A picture without a heap."""
    rng = np.random.default_rng(5)
    middle, foot = 0.5 * SIZE[0], GROUND
    if kind == "uniform":
        return canvas_of()
    if kind == "noise":
        return rng.integers(0, 255, (*SIZE[::-1], 3)).astype(np.uint8)
    if kind == "box":
        return canvas_of([(middle - 90, foot), (middle - 90, foot - 90), (middle + 90, foot - 90), (middle + 90, foot)])
    if kind in ("ball", "half a ball"):
        t = np.linspace(0.0, np.pi if kind == "half a ball" else 2.0 * np.pi, 200)
        return canvas_of([(middle + 80 * np.cos(a), foot - 80 * np.sin(a)) for a in t])
    if kind == "two heaps in one":
        low = [(middle - 160, foot), (middle - 80, foot - 60), (middle, foot - 20), (middle + 80, foot - 60), (middle + 160, foot)]
        return canvas_of(low)
    if kind == "ramp":
        return canvas_of([(middle - 150, foot), (middle + 100, foot - 80), (middle + 110, foot)])
    if kind == "plates at an angle":
        return canvas_of([(middle - 140, foot), (middle - 30, foot - 80), (middle + 150, foot - 90)])
    picture = canvas_of()
    ImageDraw.Draw(picture).multiline_text(
        (30, 40), "The angle of repose\nof a heap of grains\n" * 4, fill=(20, 20, 20), font_size=32
    )
    return picture


@pytest.mark.parametrize(
    "kind", ["uniform", "noise", "box", "ball", "half a ball", "two heaps in one", "ramp", "plates at an angle", "text"]
)
def test_what_is_no_heap_is_refused(kind, tmp_path):
    path = saved(tmp_path, drawn(kind))
    with pytest.raises(CalibrationError, match=r"heap\.png: no heap found: ") as refusal:
        read_heap(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("name", ["astronaut", "coins", "gravel", "rocket"])
def test_photographs_of_other_things_are_refused(name):
    folder = Path(skimage.__file__).parent / "data"
    (path,) = folder.glob(f"{name}.*")
    with pytest.raises(CalibrationError, match="no heap found"):
        read_heap(path)


def test_masks_that_are_no_heap_say_why():
    """Each reason by itself, as a picture may have several."""
    heap = triangle_mask(30.0, 30.0, 0.0)
    y, x = np.mgrid[:360, :640]
    ball = np.hypot(x - 320, y - 200) < 80
    wrong = {
        r"touches the left edge": np.roll(heap, -112, axis=1),
        r"touches the lower edge": np.roll(heap, 110, axis=0),
        r"\d+ x 20 pixels large": triangle_mask(30.0, 30.0, 0.0, height=20.0),
        r"has no straight lower edge": 0.6 * np.abs(x - 320) + np.abs(y - 200) < 90,
        r"inclined by 14 deg": triangle_mask(30.0, 30.0, 14.0, height=90.0),
        r"1\.00 times as wide at 80 %": (np.abs(x - 320) < 90) & (y > 150) & (y < 250),
        r"0\.6\d times as wide at 80 %": ball & (y < 200),
        r"overhangs: \d+ % of the area": heap & ~((y > 200) & (y < 244) & (np.abs(x - 250) < 30)),
        r"has 2 humps": triangle_mask(30.0, 30.0, 0.0, height=80.0) | ((np.abs(x - 400) < 8) & (y > 150) & (y < 250)),
    }
    for said, mask in wrong.items():
        with pytest.raises(NoHeap, match=said):
            outline_of(mask)
    flanks = {
        r"left flank of 3 deg": triangle_mask(15.0, 15.0, 0.0, height=60.0),
        r"flanks as unlike as 25 and 50 deg": triangle_mask(25.0, 50.0, 0.0),
        r"right flank of 7\d deg": triangle_mask(40.0, 75.0, 0.0),
    }
    for said, mask in flanks.items():
        outline = outline_of(mask)
        if "3 deg" in said:
            outline = replace(outline, left=replace(outline.left, angle_deg=3.0))
        with pytest.raises(NoHeap, match=said):
            check_flanks(outline)
    outline = outline_of(heap)
    bent = replace(outline, right=replace(outline.right, departure=0.06 * outline.height.max()))
    with pytest.raises(NoHeap, match="right flank that leaves its line by 6 % of the height"):
        check_flanks(bent)


def test_a_heap_that_leaves_the_picture_is_refused(tmp_path):
    picture = photograph(Scene()).crop((0, 0, 300, SIZE[1]))
    with pytest.raises(CalibrationError, match="touches the right edge"):
        read_heap(saved(tmp_path, picture))


def test_a_box_chooses_one_of_two_heaps(tmp_path):
    both = Image.new("RGB", (2 * SIZE[0], SIZE[1]))
    for k, angle in enumerate((25.0, 38.0)):
        both.paste(photograph(Scene(angle_deg=angle)), (k * SIZE[0], 0))
    path = saved(tmp_path, both)
    for k, angle in enumerate((25.0, 38.0)):
        heap = read_heap(path, box=(k * SIZE[0] + 20, 10, (k + 1) * SIZE[0] - 10, SIZE[1] - 10))
        assert heap.angle_deg == pytest.approx(angle, abs=0.5)
        x = heap.photo.to_photo(heap.outline.ground.picture(heap.outline.along, heap.outline.height))[:, 0]
        assert abs(np.mean(x[[0, -1]]) - (k + 0.5) * SIZE[0]) < 10
    for box in ((0, 0, 2 * SIZE[0] + 1, 100), (200, 0, 100, 100), (0, 0, 20, 20)):
        with pytest.raises(CalibrationError, match=r"BOX is .*; allowed: left,top,right,bottom inside 0,0,960,360"):
            read_heap(path, box=box)


def test_a_given_ground_cuts_off_a_mirror_image(tmp_path):
    scene = Scene(angle_deg=30.0, plate=(90, 105, 125), tilt_deg=2.0)
    upper = np.asarray(photograph(replace(scene, tilt_deg=0.0)))[: int(GROUND)]
    mirror = np.vstack([upper, upper[::-1]])[: SIZE[1]]
    path = saved(tmp_path, mirror)
    with pytest.raises(CalibrationError, match="lower edge"):
        read_heap(path)
    heap = read_heap(path, ground=(50.0, GROUND, 430.0, GROUND))
    assert heap.angle_deg == pytest.approx(30.0, abs=0.5)
    # a ground that is turned turns both flanks, and not their mean
    turned = read_heap(path, ground=(50.0, GROUND + 5.0, 430.0, GROUND - 5.0))
    tilt = np.degrees(np.arctan2(10.0, 380.0))
    assert turned.outline.ground.tilt_deg == pytest.approx(tilt)
    assert turned.left_deg - turned.right_deg == pytest.approx(heap.left_deg - heap.right_deg - 2 * tilt, abs=0.5)
    assert turned.angle_deg == pytest.approx(heap.angle_deg, abs=0.3)
    for ground in ((430, 270, 50, 270), (50, 900, 430, 900), (50, 0, 60, 0)):
        with pytest.raises(CalibrationError, match="GROUND is .*; allowed: x0,y0,x1,y1"):
            read_heap(path, ground=ground)


def test_a_large_grey_photograph_that_was_turned_is_read_upright(tmp_path):
    picture = photograph(Scene(angle_deg=30.0)).convert("L").resize((3 * SIZE[0], 3 * SIZE[1]))
    exif = Image.Exif()
    exif[0x0112] = 6  # the camera was held upright: turn by a quarter
    heap = read_heap(saved(tmp_path, picture.rotate(90, expand=True), "heap.jpg", exif=exif))
    assert heap.photo.scale == pytest.approx(800 / (3 * SIZE[0]))
    assert heap.angle_deg == pytest.approx(30.0, abs=0.5)


def test_a_deep_grey_image_has_the_same_contrast(tmp_path):
    grey = np.asarray(photograph(Scene()).convert("L"))
    deep = open_photo(saved(tmp_path, grey.astype(np.uint16) * 40, "deep.png"))
    assert deep.shape == (*grey.shape, 3)
    assert deep[..., 1] == pytest.approx((grey - grey.min()) / np.ptp(grey.astype(float)), abs=1e-6)


def test_files_that_are_no_image_are_refused(tmp_path):
    (tmp_path / "text.jpg").write_text("no image")
    whole = saved(tmp_path, photograph(Scene()), "whole.jpg").read_bytes()
    (tmp_path / "cut.jpg").write_bytes(whole[: len(whole) // 2])
    saved(tmp_path, Image.new("RGB", (40, 300)), "small.png")
    said = {
        "text.jpg": "is no image",
        "cut.jpg": "cannot be read",
        "none.jpg": "No such file",
        "small.png": "size is 40 x 300 pixels",
    }
    for name, part in said.items():
        with pytest.raises(CalibrationError, match=f"{name}.*{part}"):
            read_heap(tmp_path / name)


def test_several_photographs_are_averaged_and_make_a_line_of_a_soil_file(tmp_path):
    paths = [saved(tmp_path, photograph(Scene(angle_deg=a, seed=k)), f"{k}, 'a'.png") for k, a in enumerate((29.0, 31.0, 33.0))]
    heaps = [read_heap(path) for path in paths]
    value, error = mean_of(heaps)
    assert value == pytest.approx(31.0, abs=0.4)
    scatter = np.std([heap.angle_deg for heap in heaps], ddof=1) / np.sqrt(3) * student(2)
    assert error == pytest.approx(np.hypot(scatter, np.mean([heap.view_deg for heap in heaps])))
    # equal readings are no better than each of them, and share the view
    alike = [replace(heaps[0], flanks_deg=1.0)] * 4
    assert mean_of(alike)[1] == pytest.approx(np.hypot(alike[0].reading_deg / 2, alike[0].view_deg))
    assert heaps[0].view_deg == pytest.approx(29.0 - seen_slope(29.0, 5.0, 10.0), abs=0.02)
    assert mean_of(heaps[:1]) == pytest.approx((heaps[0].angle_deg, heaps[0].uncertainty_deg))
    (tmp_path / "sand.yaml").write_text(soil_line(heaps) + "\n")
    (row,) = measure_soil(tmp_path / "sand.yaml").to_dict("records")
    assert (row["value"], row["standard_uncertainty"]) == pytest.approx((value, error), abs=0.006)
    assert row["source"] == "photographs " + ", ".join(path.name for path in paths)


def test_a_photograph_given_twice_is_refused(tmp_path):
    with pytest.raises(CalibrationError, match=r"PHOTO is a\.png twice; allowed: different photographs"):
        read_photos([Path("a.png"), tmp_path / "b.png", Path("a.png")], folder=tmp_path / "drawn")


def test_a_given_ground_cuts_off_a_plate_that_looks_like_the_heap(tmp_path):
    picture = np.asarray(photograph(Scene(angle_deg=30.0))).copy()
    plate = picture[int(GROUND) :]
    sand = picture[int(GROUND) - 30 : int(GROUND) - 5, 190:290]
    plate[:] = np.tile(sand, (4, 5, 1))[: plate.shape[0], : plate.shape[1]]
    path = saved(tmp_path, picture)
    with pytest.raises(CalibrationError, match="no heap found"):
        read_heap(path)
    heap = read_heap(path, ground=(50.0, GROUND, 430.0, GROUND))
    assert heap.angle_deg == pytest.approx(30.0, abs=0.5)


@pytest.mark.parametrize("given", ["1,2,3", "a,b,c,d", "1,2,3,nan"])
def test_a_box_that_is_not_four_numbers_is_refused(given):
    with pytest.raises(SystemExit, match=r"BOX is .*; allowed: four numbers separated by commas"):
        main(["heap.png", f"--box={given}"])


def test_the_command_draws_the_photograph_and_prints_a_line_for_the_soil_file(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    saved(tmp_path, photograph(Scene(angle_deg=38.0)))
    main(["heap.png"])
    first, drawn_to, *_, last = capsys.readouterr().out.splitlines()
    assert re.match(r"heap\.png: 3[78]\.\d\d \+- 0\.\d\d deg \(left 3[78]", first)
    assert drawn_to.split()[-1] == "results/read_photo/heap.png"
    assert last.startswith("angle_of_repose_deg: {value: ")
    picture = np.asarray(Image.open("results/read_photo/heap.png").convert("RGB")).reshape(-1, 3)
    for colour in (COLOURS[1], COLOURS[4], COLOURS[5]):  # flanks, ground, outline
        assert (np.abs(picture - np.array(to_rgb(colour)) * 255).max(axis=1) < 8).sum() > 50


def test_the_command_says_what_is_wrong_in_a_line(tmp_path):
    saved(tmp_path, drawn("uniform"), "empty.png")
    command = [sys.executable, "-m", "virtual_soil.report.read_photo", "empty.png"]
    result = subprocess.run(command, cwd=tmp_path, env=ENVIRONMENT, capture_output=True, text=True, check=False)
    assert result.returncode == 1
    assert result.stderr == "empty.png: no heap found: nothing differs enough from what is around it.\n"
    made = subprocess.run(
        ["make", "-n", "--no-print-directory", "angle", "PHOTO=a.jpg b.jpg", "BOX=1,2,3,4"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert made.stdout.splitlines()[-1].split()[-4:] == ["virtual_soil.report.read_photo", "a.jpg", "b.jpg", "--box=1,2,3,4"]
