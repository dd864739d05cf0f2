"""Job for a photo with a vision-language model that fills in the template; its measures are initial values of the fit."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.models.annotators.vlm.template_choice import TemplateInput
from manitwin.models.annotators.vlm.template_likeness import Likeness
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.generators.lift.photo_generation import LiftResult, fit_or_lift, generate_from_photo
from manitwin.models.generators.lift.review_rounds import (
    ReviewResult,
    add_review_notes,
    render_review_pictures,
    require_accepted,
    review_twice,
)
from manitwin.models.generators.protocol import GenerationRequest
from manitwin.models.generators.templates.filled_template import FilledTemplate, replace_looks
from manitwin.models.generators.templates.fitting.fit import TemplateFit, alternative_categories, fit, template_for
from manitwin.models.generators.templates.fitting.generated import texture_fit, visual_part


@dataclass(frozen=True)
class _Fit:
    filled: FilledTemplate
    fitted: TemplateFit


def generate_photo_guided(request: GenerationRequest, reader: TemplateReader) -> LiftResult:
    """Return the template chosen and filled in by a model, fitted to the photo.

    If the model chooses no template, the result is that of the name without a model, or the lifted silhouette. Raises the
    errors of the model, and Rejected if the model says in both rounds that an acceptable fit is wrong.
    """
    rgba = request.rgba
    assert rgba is not None
    name = None if request.guessed else request.name
    shown = TemplateInput(rgba, None, name)
    choice = reader.choose(shown)
    findings = list(choice.findings)
    if choice.category is None:
        findings.append(f"{reader.source} says that it is none of the templates")
        return add_review_notes(generate_from_photo(rgba, request.name, request.focal_mm), reader, None, findings)
    filled, left_out = reader.fill(shown, choice.category)
    findings += left_out
    first = _fit(filled, rgba, name, request.focal_mm)
    called = name or choice.category
    if first is None:
        findings.append(f"no {filled.category} near the measures that {reader.source} gave is a solid")
        return add_review_notes(generate_from_photo(rgba, request.name, request.focal_mm), reader, filled, findings)

    def compare(this: _Fit, before: str) -> Likeness:
        fitted = this.fitted
        toward = fitted.view.object_to_camera[2]
        azimuth, elevation = np.degrees(np.arctan2(toward[1], toward[0])), np.degrees(np.arcsin(toward[2]))
        parts = [visual_part(texture_fit([fitted], [rgba]))]
        pictures = render_review_pictures(parts, float(azimuth), float(elevation), reader.settings.picture_px)
        return reader.compare(shown, fitted.category, fitted.made.measures, pictures, before)

    def correct(this: _Fit, corrected: FilledTemplate) -> tuple[_Fit, str]:
        other = replace(this.filled, category=corrected.category).merged_with(corrected)
        begin = replace(other, measures={**this.fitted.made.measures, **corrected.measures})
        second = _fit(begin, rgba, name, request.focal_mm) if corrected.measures else None
        if second is not None and second.fitted.residual.cost < this.fitted.residual.cost:
            return replace(
                second, filled=other
            ), "Your correction explains the outline in the photo better: this is how it is now."
        said = replace(this.filled, wishes=other.wishes)
        dressed = replace(this, fitted=replace_looks(this.fitted, corrected.wishes), filled=said)
        if second is None:
            return dressed, "Nothing of its shape was corrected: this is how it is now."
        return dressed, "Your correction explains the outline in the photo no better: its shape is as before."

    agreed: ReviewResult[_Fit] = review_twice(first, compare, correct)
    findings += agreed.findings
    kept = agreed.final
    if kept.fitted.category != filled.category:
        findings.append(
            f"{reader.source} says {filled.category}, but a {kept.fitted.category} explains the outline clearly better"
        )
    job = fit_or_lift(kept.fitted, rgba, called)
    if job.known is None:
        findings.append(f"no {kept.fitted.category} explains the outline: the photo was lifted")
    else:
        require_accepted(agreed, f"a {kept.fitted.category} fitted to the photo", reader)
    return add_review_notes(job, reader, kept.filled, findings, agreed)


def _fit(filled: FilledTemplate, rgba: np.ndarray, name: str | None, focal_mm: float | None) -> _Fit | None:
    """Fit a filled template; usual measures, or the template of the user's name, replace it if they explain the photo better."""
    said = template_for(name)
    others = [filled.category] if filled.measures else []
    others += (
        alternative_categories(filled.category) if said is None or said.category == filled.category else [said.category]
    )
    fitted = fit(filled.category, rgba, filled.measures, or_of=others, focal_mm=focal_mm)
    if fitted is None:
        return None
    wishes = filled.wishes if fitted.category == filled.category else {}
    return _Fit(filled, replace_looks(fitted, wishes))
