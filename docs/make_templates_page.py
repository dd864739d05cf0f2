"""Generate docs/templates.md from the templates.

python docs/make_templates_page.py            writes the page
python docs/make_templates_page.py --check    exits with status 1 if the page is out of date
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np

from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import DIRECTIONS, ObjectDescription
from manitwin.models.generators.templates.looks import COLORS, MATERIALS, SAME_MATERIAL, SHADES
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.template_object import TemplateObject
from manitwin.models.generators.templates.vocabulary import RELATIVE

PAGE = Path(__file__).parent / "templates.md"
INTRODUCTION = """# Things from a sentence: the templates

Words become twins of everyday things, without a model:

```sh
manitwin build --text "a red ceramic mug, 9 cm" --text "a hammer with a yellow handle" --quick -o twins
```

![One thing of each template, as seed 0 makes it](templates.webp)

The built-in generator `lift` makes the categories below from words alone: no GPU, no key, nothing downloaded. Each is a
template: measures within the interval that such things have, parts with a name, a material and a density each, and places
whose use is known by construction. So size, mass, centre of mass and inertia follow from the parts, and functional points are on
the right part; their source is `template:CATEGORY`. What is not here is refused at once, with the nearest categories and the
[generators](generators.md) that make other things of a text.

- **How many**: `--count 20` makes twenty of each text. What the text says holds for all; what it leaves open is drawn anew for
  each: measures, colours and materials, of a stated material the colours that such things have. The same seed gives the same
  twenty. A text is one thing: "two forks" and "a set of spoons" are refused and point here; a pair of pliers is one.
- **What it is**: one of the names below, or another word for it that the [priors](priors.md) know. The last noun counts: a mug
  rack is no mug. A name that is marked *alone* means it where no other noun is said with it: a white king is a chess king, and
  a king size bed is refused. Where a thing's name is not in the text, the build says what it was taken as. The twin is called
  as the text calls it (a skillet is a skillet, made by the frying pan's template).
- **How it looks**: colours and materials before or after the name are those of the whole (a colour of a steel tool is its
  handle's); behind *with*, of a part, and of further ones behind *and*: `a small hammer with a red handle and a black head`.
  As shops write it behind a comma, too: `screwdriver, shaft 15 cm, red handle`, `a mug, white outside and yellow inside`. A
  part in a colour of its own ends at edges of the mesh (a plate's blue rim at a circle). What the text does not say is drawn
  from the seed. Two colours or two materials of one part are refused. What is in a thing, or what it is for, says nothing of
  it (a glass of red wine, a brush for wood); nor does a word that is not known: the check `text_understood` names such.
- **How large it is**: `9 cm` is the longest extent, of a pan or pot its diameter; `9 cm tall`, `wide`, `long` is that
  direction (a chef's knife is called by its blade, a phone, tablet or laptop of so many inches by the diagonal of its screen,
  a wrench and an allen key of some millimetres by their nuts and screws, a paint brush and a putty knife by their width). `30
  x 20 x 15 cm` is length, width and height, `30 x 20 cm` the longest side and the second (of a round bowl its width and its
  height). `15 cm wide and 7 cm high` and `with a 20 cm blade` change the measures until what is made has these lengths, within
  0.2 %; what would no longer be such a thing is refused (a mug of 10 by 80 cm), but a box may be of any proportions. `500 ml`,
  `12 oz` and `1 pint` (of the United States) are what a vessel holds to its brim, a closed one within its walls; `2 kg` is
  what the thing weighs: either sets the size. A volume may stand beside lengths (`a mug, 9 cm tall, 300 ml`), a mass may not.
  Units may be spelt out, and inches, feet, yards and fractions are read, British pints and gallons, and one amount in two
  units (`12 in / 30 cm`). Sizes of standards are known: paper of a notebook or a book (A5, B6, letter), envelopes (C5, DL,
  #10), batteries (AAA), bolts, nuts and washers (M8 x 40), and the toy brick of 2x4 studs 8 mm apart. A size that no such
  thing has is refused. `small` and `large` choose within the usual sizes.
- **What it cannot be told** is refused and not left out: two lengths of one side, from which to which a length is, what a
  thing is not, a number without a unit, a size of shoes or clothes. So is the longer name of another thing (a garlic bulb is
  no light bulb).
- **What it is made of** decides the mass: the volume of each part times its density; of a closed container, with its contents;
  hollow behind a sheet where a handle or a stand of sheet metal would be. It is no estimate, has no interval, and is not refused
  for being unlike that of most such things (a plastic fork); a finding says so.

## A photo gets its template, fitted

A photo with one of these names gets the template too: `lift` looks for the measures, the camera's elevation, turn, roll and
lens whose picture has the photo's outline, and takes the one that inner edges, shading and the share of hidden parts speak
for. A bottle that lies in the photo stands in the twin; a mug seen from above has its hollow and its handle. A plain name
stands for its kinds: a can may be a drink can where that explains the photo better.

- **Confidence** (`generation.notes.confidence`) follows from the residual: the overlap of the outlines, and their mean
  distance over the object's length. Below a half the template is not believed: the photo is lifted to a revolution or a box,
  or rejected with the numbers where the name is that of an open container. Before an inflation, which knows nothing of the
  back, it is believed above 0.12. Thresholds come from rendered photos of templates with other measures, bent by 8 % of their
  size, under right and wrong names: 92 % of the right ones are believed, 14 % of wrong ones drawn at random.
- **Size, mass and material** stay those of the priors: a photo tells proportions only. Points are known by construction, as
  of a text; their source is `template:CATEGORY, fitted to the photo`.
- **Without a name**, from a person or a classifier, it is a box where its outline has the six corners of one seen from a corner,
  which tell its sides; else a block, a slab with round corners, a cylinder or a disc where that explains the outline almost to
  the pixel and its edges are seen (so too under a name without a template, or with one that is not believed); else it has the
  shape of a template of its likeliest names (from a tenth on) where that explains the photo closely, and much better than a body
  of revolution: a cup that may be a mug or a bucket is hollow in either case, and is called neither. What none explains is
  lifted, and is rejected where the outline is an ellipse: a disc seen at an angle has it as well as an egg.
- **Unlike such a thing**: what its template and prior say is not round is not lifted to a body of revolution (a shoe seen from
  its toe has the outline of one), nor is anything lifted to a solid that is more than twice as long over its width or thickness,
  or less than half, as all that the template makes (a pencil nearly from its end, a frisbee at its edge). The template's own fit
  is taken where it is believed above 0.12, else the photo is rejected, with the proportions found and usual ones.
- **From the end** nothing of a length is seen: what is tall or long by its name, is seen from above or along its length, and
  has an outline that an ellipse explains much better than the template, is rejected (of a glass or a jar the rim alone). Take
  the photo from the side.
- **Texture**: the photo on what it shows. Unseen places get quiet colours of their own part: those of the same ring where it
  is turned, else of the nearest seen places, as a median that keeps no letters.
- **What it cannot do**: walls thinner than a pixel keep the usual thickness; a box seen at one face alone has the usual
  depth; what the template has no measure for (a bent handle, a crushed can) is not followed.

## With a vision-language model

With `--vlm` a model reads what the plain reader does not. It chooses the template of every photo, named or not, and of
every text in which a word says nothing to a template, and fills in measures, colours and materials: `a squat blue espresso
mug with a thick handle` gets its width and its handle. "None of these" is an answer: a photo is then built by its name, a
text is the error that lists the nearest categories. Only the fields of a form come back, nothing is run; a measure that no
such thing has is asked for once more, then left out and said (`quality.checks`, `template_filled`). The fit to the outline
begins at the measures, and at the usual ones too, so that a wrong answer costs little. What a text states in plain words
and lengths comes before what the model says.

Then the model sees the thing from three sides beside the photo or the words. If it calls it wrong, it corrects measures and
looks once; of the two fits the one that explains the photo better stays, and is shown again. What it calls wrong twice is
rejected, with its words. [What is asked, sent and paid](vlm.md#templates).

`python benchmarks/filled_templates.py OUT --categories "mug,bottle,frying pan,box"` (volumetric overlap with the true solid,
seen from 30 degrees, seed 0): 0.99, 0.94, 0.91 and 0.96 without a model; 0.98, 0.98, 0.95 and 1.00 with true measures; 0.99,
0.93, 0.91 and 0.96 with the wrong end of every interval; as with true ones where these are corrected. A photo costs 2 to 3
CPU-s more, and 4 more where it is corrected.

## Texts and points, measured

`python benchmarks/texts.py DATASET --count 3`, which builds with `--quick`: of 180 twins (60 categories in three variations) 174
are verified (96.7 %). 111 of them were built before openings and poses were last changed; what was rejected then was built again.
Rejected are two speakers wider than the gripper opens, two rolling pins, which roll, and a trash
can and a serving tray that fell from every grip at their rims.

`python benchmarks/text_sizes.py`: with two sides of another such thing stated, length and height, 425 of 446 categories are
made, with three 415, each side within 0.2 %; the others, knives, saws and rackets most of all, have a side that no measure of
theirs changes, and say so. Of 89 vessels 86 can be told that they hold 400 ml: a nail polish bottle is smaller, a napkin holder
is no vessel, and a moka pot is made without its hollow. It costs 0.1 CPU-s in the median.

`python benchmarks/points.py --held-out`: the annotator `rules`, which is told none of a template's points, puts 97.8 % of
them at their place (496 of 507; 58 categories x 3 seeds; 3 are not judged), and 97.8 % in the half by which the rules
were improved (585 of 598; 69 categories x 3; without `--held-out`). Candidates by farthest point sampling alone, without
a closer look (`--plain`, 3 seeds each), give 97.4 and 97.2 %. From known features of their label the points are 4.3 and
5.5 mm away in the median (`--plain`: 8.2 and 11.2 mm), but nine of ten within 39 and 50 mm (36 and 58): bases and tops,
which are meant as a whole, are not moved to their middles. What it takes for right stands in
`benchmarks/known_places.py`: a part, or a region of the template's frame, where a label speaks of no part. Labels that
were wrong of a thing (the lid of a battery) were mended in both halves. Most wrong are an umbrella's tip, a flashlight's
switch, and a bell's clapper.

The figures so far are of the first 127 categories. Of the 114 made after them (one of each, `--quick`) 106 are verified, with
10,079 of 10,741 grasps held (93.8 %): a laptop, a suitcase, a kettle and a fire extinguisher are held too far from their centre
of mass, a soccer ball is wider than the gripper opens, friction holds a toaster in no grasp, a tea infuser rolls and a squeegee
has no stable pose. The rules, which had been shown none of them, put 694 of 783 points at their place (88.6 %; 3 seeds, 133 not
judged). Most of what was wrong were labels of parts that such things lack (a microphone has no lens, a pestle does not grind
with its thin end); since these were mended, and more of the labels are judged, it is 872 of 891 (97.9 %; `--later --seeds 3`),
and 569 of 588 (96.8 %) of seeds not seen before (`--later --first 500 --seeds 2`). Of 87 rendered photos of 29 of them
(`photo_generation.py OUT --held-out`, named, from 10, 30 and 55 degrees) 76 are accepted, the others rejected for their cut-out;
their volumes overlap the true ones by 0.94 in the median, least those of spirit levels, envelopes and sticky
notes (0.61 to 0.93).

Of the 21 kinds made last (chess pieces to bell peppers; three of each, `--quick`, seed 5) 63 of 63 are verified. The rules
put 164 of 169 of their points at their place (3 seeds), those of eight of them by labels written for them. French presses are
heavy for their handles: 172 of 312 of their grasps hold. Of 18 rendered photos of six of them, named, 17 are accepted,
with volumes that overlap the true ones by 0.97 in the median.

Of 81 kinds made after those (packs as shops sell them, keepsakes, small goods, toys; one of each, `--quick`, seed 3) 76 are
verified; three packs are wider than the gripper opens, a tool box is too heavy, a drinking straw rolls. The rules, which had
been shown none of them, put 393 of 420 of their points at their place (93.6 %; two seeds, 49 not judged): wrong are ends of what
is alike at both, the blade of a folded knife and the spout of a moka pot. Of 96 rendered photos of 32 packs
(`photo_generation.py OUT --held-out`, named) 94 are accepted, and their volumes overlap the true ones by 0.98 in the median,
least that of a glue bottle (0.84); of 75 photos of 25 of the others 63, by 0.96, none of them of a corkscrew or a toy boat, which
are rejected for their cut-out, least measuring spoons (0.79).

`python benchmarks/frames.py --held-out`: frames from geometry, asked for at the candidate nearest to a known point, are
right (opening 5 mm and 3 degrees, face 3 mm and 3, hole 2 mm and 5, edge 10 degrees, tip 5 mm and 10, button 3 mm and 10)
for 31 of 36 openings, 49 of 62 faces, 7 of 10 holes, 3 of 8 edges, 12 of 26 tips and 7 of 20 buttons; wrong are 1, 6, 0,
0, 4 and 2, the others have no frame or are of another kind. The tuning half: 22 of 28, 46 of 48, 15 of 22, 12 of 16, 31
of 38, 9 of 14; wrong 0, 0, 0, 0, 2, 0. 0.06 CPU-s a thing. Where what is around a point ends in several directions, or
bristles may stand ahead or aside, there is no frame and its reason says so; a button is small and flat, or there is none. A
pitcher's spout and a nozzle are not to be relied on. The held-out half was looked at while buttons, spouts and bristles
were mended, so it is not quite blind.

This page is written by `python docs/make_templates_page.py`, its picture by `python docs/make_templates_picture.py`.
"""


def first_thing(template: Template) -> TemplateObject:
    """Return the thing that seed 0 makes."""
    return make_object(template, ObjectDescription(template.category), np.random.default_rng(0))


def row(template: Template, made: TemplateObject) -> str:
    """Return the row of one template: its names, the parts of a thing that it made, and what is known of it."""
    points = ", ".join(dict.fromkeys(point.label for point in made.points))
    alone = (f"{name} (alone)" for name in template.bare)
    names = ", ".join((template.category, *template.names, *alone))
    return f"| {names} | {', '.join(made.mesh.names)} | {points} |"


def page(thing_of: Callable[[Template], TemplateObject] = first_thing) -> str:
    """Return the page, of a thing of each template."""
    templates = load_templates().values()
    parts = [INTRODUCTION]
    for group in ("kitchen", "tools", "electronics", "personal", "office", "household"):
        rows = [row(template, thing_of(template)) for template in templates if template.group == group]
        head = f"## {group.capitalize()} ({len(rows)})\n\n| names | parts | known points |\n|---|---|---|\n"
        parts.append(head + "\n".join(rows) + "\n")
    parts.append(
        "## Words\n\n"
        f"Colours: {', '.join(sorted(COLORS))}; before them {', '.join(sorted(SHADES))}.\n\n"
        f"Materials: {', '.join(sorted(MATERIALS))}.\n\n"
        f"Other words for them: {', '.join(f'{word} ({name})' for word, name in sorted(SAME_MATERIAL.items()))}.\n\n"
        f"Directions: {', '.join(sorted(DIRECTIONS))}. Sizes: {', '.join(sorted(RELATIVE))}.\n"
    )
    return "\n".join(parts)


if __name__ == "__main__":
    if sys.argv[1:] == ["--check"]:
        sys.exit(int(PAGE.read_text() != page()))
    PAGE.write_text(page())
