"""Quality question: the paper's two criteria, each with evidence, compared with the photo; an unclear answer counts as failed."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field

from manitwin.models.annotators.protocol import QualityVerdict, Subject
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import name_line
from manitwin.models.annotators.vlm.view_pictures import clean_views, photos_beside
from manitwin.models.vlm.protocol import Question
from manitwin.models.vlm.strict_schema import strict_schema

Decision = Literal["yes", "no", "unsure"]
Severity = Literal["none", "minor", "severe", "unsure"]


class Artifact(BaseModel):
    """One kind of artifact."""

    model_config = ConfigDict(frozen=True)

    evidence: str = Field(description="what is seen of it and in which views; 'nothing seen' if there is none")
    severity: Severity


class QualityAnswer(BaseModel):
    """The answer: what is seen first, then the decision."""

    model_config = ConfigDict(frozen=True)

    shown: str = Field(description="what the pictures show, in one sentence")
    objects_evidence: str = Field(description="which separate things or loose pieces are there, and in which views")
    single_object: Decision = Field(description="exactly one coherent object")
    fragmentation: Artifact
    texture_corruption: Artifact
    geometric_implausibility: Artifact
    quality_evidence: str = Field(description="what decides the second criterion, in one sentence")
    visual_quality: Decision = Field(description="free of severe artifacts")

    @property
    def artifacts(self) -> dict[str, Artifact]:
        """The three kinds of artifacts by name."""
        return {
            "fragmentation": self.fragmentation,
            "texture corruption": self.texture_corruption,
            "geometric implausibility": self.geometric_implausibility,
        }

    def artifacts_of_severity(self, severity: Severity) -> list[str]:
        """Return the kinds of artifacts with a severity."""
        return [name for name, artifact in self.artifacts.items() if artifact.severity == severity]


class QualityBesidePhotoAnswer(QualityAnswer):
    """The answer where the photos that the model was made of are shown beside it."""

    photo_evidence: str = Field(
        description="which parts the photo shows and the model lacks, or has cut off or flattened"
    )
    like_photo: Decision = Field(description="the model is the whole thing that the photo shows")


def quality_answer(subject: Subject) -> type[QualityAnswer]:
    """Return the model class of the answer; with a photo it includes the likeness to the photo."""
    return QualityBesidePhotoAnswer if subject.photos else QualityAnswer


def quality_question(subject: Subject, prompt: Prompt, picture_px: int) -> Question:
    """Ask for the criteria with all views, beside the photos from which the object was made."""
    made_of = ""
    if subject.photos:
        made_of = (
            "It was made of the photo that comes first: sides that the photo does not show are guessed. Judge like_photo too:"
            " whether the model is the whole thing that the photo shows, no half or slice of it."
        )
    values = {"count": str(len(subject.views)), "name": name_line(subject.name, subject.known_as), "made_of": made_of}
    pictures = [*photos_beside(subject, picture_px), *clean_views(subject)]
    instructions, parts = prompt.filled(values, pictures)
    return Question("quality", instructions, parts, strict_schema(quality_answer(subject)))


def examine_quality(answer: QualityAnswer) -> list[str]:
    """Return why the answer is not a decision: it is unsure, or contradicts its evidence."""
    findings = []
    if answer.single_object == "unsure":
        findings.append("single_object is unsure: look at every view again and answer yes or no")
    if answer.visual_quality == "unsure":
        findings.append("visual_quality is unsure: look at every view again and answer yes or no")
    severe, unsure = answer.artifacts_of_severity("severe"), answer.artifacts_of_severity("unsure")
    if unsure and answer.visual_quality == "yes":
        findings.append(f"{', '.join(unsure)} is unsure, but visual_quality is yes: say none, minor or severe")
    if severe and answer.visual_quality == "yes":
        findings.append(f"{', '.join(severe)} is severe, but visual_quality is yes: one of the two is wrong")
    if not severe and answer.visual_quality == "no":
        findings.append("visual_quality is no, but no artifact is severe: name the severe one, or answer yes")
    if isinstance(answer, QualityBesidePhotoAnswer) and answer.like_photo == "unsure":
        findings.append("like_photo is unsure: compare every view with the photo again and answer yes or no")
    return findings


def quality_verdict(answer: QualityAnswer) -> QualityVerdict:
    """Convert the last answer to the verdict; an unsure answer, or a yes against the evidence, counts as no."""
    doubtful = answer.artifacts_of_severity("severe") + answer.artifacts_of_severity("unsure")
    single, sound = answer.single_object == "yes", answer.visual_quality == "yes" and not doubtful
    if isinstance(answer, QualityBesidePhotoAnswer) and answer.like_photo != "yes":
        said = _unsure_prefix(answer.like_photo) + answer.photo_evidence
        return QualityVerdict(single, False, f"not the whole thing that its photo shows: {said}")
    if single and sound:
        return QualityVerdict(True, True, answer.shown)
    reasons = []
    if not single:
        reasons.append(_unsure_prefix(answer.single_object) + answer.objects_evidence)
    if not sound:
        kinds = [f"{name} ({a.severity}): {a.evidence}" for name, a in answer.artifacts.items() if name in doubtful]
        reasons.append(_unsure_prefix(answer.visual_quality) + "; ".join([*kinds, answer.quality_evidence]))
    return QualityVerdict(single, sound, " | ".join(reasons))


def _unsure_prefix(decision: Decision) -> str:
    return "unsure when asked twice: " if decision == "unsure" else ""
