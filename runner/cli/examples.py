"""Examples of each command as it is typed, which its help text ends with."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

EXAMPLES: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "new": (
            "cyclopean new my_study photos/",
            'cyclopean new my_study left/ right/ --kind rating --question "How natural does it look?"',
            "cyclopean new my_study scenes/ --kind within-groups --mode side-by-side --panel 1920x1080,0.2768",
            "cyclopean new my_study --from dynamic_range",
        ),
        "check": (
            "cyclopean check experiments/dynamic_range.yaml",
            "cyclopean check experiments/dynamic_range.yaml --mode quad-buffered --screen",
            "cyclopean check configs/displays/asus_vg248qe.yaml",
        ),
        "run": (
            "cyclopean run experiments/dynamic_range.yaml --observer 01",
            "cyclopean run experiments/dynamic_range.yaml --observer 01 --resume",
            "cyclopean run experiments/paints.yaml --observer 01 --simulate configs/observers/paints.yaml",
        ),
        "watch": (
            "cyclopean watch results",
            "cyclopean watch results --once --json",
        ),
        "report": (
            "cyclopean report results/dynamic_range",
            "cyclopean report results/dynamic_range -o report.html --pdf --csv tables",
            "cyclopean report station_a/results station_b/results -o report.html",
        ),
        "export": ("cyclopean export results/dynamic_range -o bids --name 'Gloss of plates'",),
        "verify": (
            "cyclopean verify results/dynamic_range",
            "cyclopean verify results --mirror /media/backup/results",
            "cyclopean verify results/dynamic_range --key paints.pub",
        ),
        "seal": (
            "cyclopean seal results/dynamic_range",
            "cyclopean seal --new-key ~/keys/paints",
            "cyclopean seal results/dynamic_range --key ~/keys/paints",
        ),
        "scores": (
            "cyclopean scores table.csv",
            "cyclopean scores table.csv --pairs --margin 0.5jnd --checks",
            "cyclopean scores table.csv --method map --prior-sd 2 --json",
        ),
        "power": (
            "cyclopean power experiments/dynamic_range.yaml --scores configs/observers/table_4_4.yaml",
            "cyclopean power experiments/paints.yaml --observers 10:30:5 --pair GM1-base-1.3 GM1-base-4",
        ),
        "preview": (
            "cyclopean preview experiments/dynamic_range.yaml -o screens",
            "cyclopean preview experiments/dynamic_range.yaml -o screens --observer 02 --clipping",
        ),
        "display new": (
            "cyclopean display new -o my_monitor.yaml --white-cd-m2 120 --panel 1920x1080,0.2768",
            "cyclopean display new -o projector.yaml --nominal bt1886 --white-cd-m2 48 --panel 1920x1080,1.2",
        ),
        "display patches": (
            "cyclopean display patches configs/rigs/asus_vg248qe_3dvision.yaml --set table_c1 --list",
            "cyclopean display patches configs/rigs/asus_vg248qe_3dvision.yaml --each 3",
        ),
        "display measure": (
            "cyclopean display measure my_rig.yaml --instrument spotread -o readings.jsonl",
            "cyclopean display measure my_rig.yaml --instrument spotread -o readings.jsonl --resume",
        ),
        "display fit": (
            "cyclopean display fit readings.csv",
            "cyclopean display fit readings.csv --mode side-by-side --eye left -o my_monitor.yaml",
        ),
        "display verify": (
            "cyclopean display verify --display my_monitor.yaml --mode side-by-side --instrument spotread",
        ),
        "display convert": (
            "cyclopean display convert codes.csv --display configs/displays/asus_vg248qe.yaml --to xyz",
            "cyclopean display convert --display my_monitor.yaml --mode side-by-side --to icc -o my_monitor.icc",
        ),
        "display metamerism": ("cyclopean display metamerism paints.csv readings.jsonl --illuminant D65",),
        "display report": ("cyclopean display report readings.csv -o display.html",),
        "camera fit": (
            "cyclopean camera fit chart.dng --reference chart.csv -o camera.yaml",
            "cyclopean camera fit correspondences.csv --form affine",
            "cyclopean camera fit shot1.dng shot2.dng --reference chart.csv -o camera.yaml",
        ),
        "camera develop": (
            "cyclopean camera develop photo.dng --camera configs/cameras/nikon_d800.yaml -o developed",
            "cyclopean camera develop photo.dng --dark darks --flat flats -o photo.exr",
        ),
        "camera bracket": (
            "cyclopean camera bracket short.dng middle.dng long.dng -o scene.exr",
            "cyclopean camera bracket short.dng long.dng --camera configs/cameras/nikon_d800.yaml -o scene.exr",
        ),
        "camera geometry": (
            "cyclopean camera geometry --sensor-mm 36x24 --pixels 7360x4912 --focal-mm 105 --distance-mm 700",
            "cyclopean camera geometry --sensor-mm 36x24 --pixels 7360x4912 --focal-mm 50 --px-per-mm 14.6",
        ),
        "camera spectral": ("cyclopean camera spectral scene.hdr --quantity radiance -o scene.exr",),
        "compare": (
            "cyclopean compare photo.exr rendering.exr --regions configs/regions/plate.yaml -o compare.html",
            "cyclopean compare photo.nef rendering.exr --regions regions.yaml --camera camera.yaml",
        ),
        "agreement": (
            "cyclopean agreement results/blur --measures delta-e-2000,flip --photograph original -o agreement.html",
            "cyclopean agreement results/scenes --measures all --photograph codec=original --csv tables",
            "cyclopean agreement results/blur --measures flip --photograph original --limit flip=0.05 --json",
        ),
        "stimuli build": (
            "cyclopean stimuli build configs/stimuli/manitoba_gray.yaml --rig configs/rigs/asus_vg248qe_3dvision.yaml",
            "cyclopean stimuli build my_study/recipe.yaml --pixel-pitch-mm 0.2768 --export-exr pictures",
        ),
        "stimuli contrast": (
            "cyclopean stimuli contrast configs/stimuli/manitoba_gray.yaml --pixel-pitch-mm 0.2768 -o contrast.svg",
        ),
        "stimuli list": ("cyclopean stimuli list",),
        "stimuli clean": ("cyclopean stimuli clean --hours 1",),
        "show": (
            "cyclopean show plate.exr --display configs/displays/asus_vg248qe.yaml --mode side-by-side",
            "cyclopean show photo.jpg --display my_monitor.yaml --mode flat --flat --white-luminance 100",
        ),
        "demo": ("cyclopean demo", "cyclopean demo --observers 10 --json"),
        "doctor": ("cyclopean doctor", "cyclopean doctor --timing --seconds 5"),
        "schema": ("cyclopean schema experiment > experiment.schema.json", "cyclopean schema rig"),
        "help": ("cyclopean help check", "cyclopean help display fit"),
        "completion": ('eval "$(cyclopean completion bash)"', "cyclopean completion fish | source"),
    }
)
