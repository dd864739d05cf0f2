"""The questions that come before there is a mesh: which template it is, its measures, and whether it is like the photo."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from PIL import Image

from manitwin.config import VlmConfig
from manitwin.models.annotators.protocol import Subject
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.template_choice import TemplateInput, choice_question
from manitwin.models.annotators.vlm.template_likeness import FIRST_LOOK, likeness_question
from manitwin.models.annotators.vlm.template_measures import measures_question
from manitwin.models.annotators.vlm.view_pictures import read_picture
from manitwin.models.generators.lift.review_rounds import render_review_pictures
from manitwin.models.generators.templates.fitting.fit import template_for
from manitwin.models.vlm.protocol import Question
from manitwin.render.background_colors import foreground_mask
from manitwin.twin.loaded_twin import Twin


def template_questions(
    twin: Twin, subject: Subject, settings: VlmConfig, prompts: Mapping[str, Prompt]
) -> tuple[list[Question], str]:
    """Return the three questions as they would be asked of what a twin was made of, and what differs, for the reader.

    A twin that was made of no photo is shown by its first view in the photo's place. Where no template is called what the twin
    is, the two questions that need one are left out. The model that is compared is the twin itself, its measures are usual ones.
    """
    remarks = ["The template questions are asked with the generator `lift`, before the others."]
    prompt = twin.record.source.prompt
    if subject.photos:
        with Image.open(subject.photos[0]) as photo:
            shown = TemplateInput(np.asarray(photo.convert("RGBA")), None, subject.name)
    elif prompt is not None:
        shown = TemplateInput(None, prompt, subject.name)
    else:
        view = read_picture(subject.views[0])
        alpha = np.where(foreground_mask(view), 255, 0).astype(np.uint8)
        shown = TemplateInput(np.dstack([view, alpha]), None, subject.name)
        remarks.append("This twin was not made from a photo: one of its views takes the place of the photo.")
    asked = [choice_question(shown, prompts["template"], settings.picture_px)]
    template = template_for(subject.name) or template_for(subject.known_as)
    if template is None:
        remarks.append("No template has the name of this object: measures and likeness are not asked.")
        return asked, " ".join(remarks)
    remarks.append("The model in the last one is the twin itself; its measures are the template's usual ones.")
    measures = {name: measure.typical for name, measure in template.measures.items()}
    pictures = render_review_pictures(subject.parts, -90.0, 20.0, settings.picture_px)
    asked.append(measures_question(shown, template.category, prompts["template_measures"], settings.picture_px))
    asked.append(
        likeness_question(
            shown,
            template.category,
            measures,
            pictures,
            prompts["template_likeness"],
            settings.picture_px,
            round_line=FIRST_LOOK,
        )
    )
    return asked, " ".join(remarks)
