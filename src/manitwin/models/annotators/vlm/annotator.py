"""Annotator that asks a vision-language model the paper's four questions, and checks the answers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from pydantic import BaseModel

from manitwin.config import BuildConfig, Resource
from manitwin.errors import BadReply
from manitwin.models.annotators.protocol import (
    AnnotatorQuestion,
    CloserLook,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    SelectedPoints,
    Subject,
)
from manitwin.models.annotators.vlm.captions import (
    CaptionsAnswer,
    admissible_language,
    caption_findings,
    captions_question,
)
from manitwin.models.annotators.vlm.closer_look import (
    CLOSER_FORM,
    LETTERS,
    chosen_places,
    closer_answer,
    closer_question,
    nearby_pictures,
    nearby_places,
)
from manitwin.models.annotators.vlm.grasp_vote import Ballot, ballots, elect_grasps, spare_grasps
from manitwin.models.annotators.vlm.physical import PhysicalAnswer, physical_estimates, physical_question
from manitwin.models.annotators.vlm.physical_checks import (
    PhysicalFinding,
    examine_physical,
    measure,
    reject_impossible,
    texts,
)
from manitwin.models.annotators.vlm.place_checks import PlaceChecks
from manitwin.models.annotators.vlm.points import (
    examine_points,
    functional_answer,
    functional_numbering,
    functional_points,
    functional_question,
    grasp_answer,
    grasp_numbering,
    grasp_question,
)
from manitwin.models.annotators.vlm.prompt_files import Prompt, load_prompts
from manitwin.models.annotators.vlm.quality import (
    QualityBesidePhotoAnswer,
    examine_quality,
    quality_answer,
    quality_question,
    quality_verdict,
)
from manitwin.models.annotators.vlm.template_reader import TemplateReader
from manitwin.models.vlm.chat_from_spec import anthropic_from_spec, openai_from_spec, replay_from_spec
from manitwin.models.vlm.concurrent_questions import ask_concurrently
from manitwin.models.vlm.prices import expected_usd
from manitwin.models.vlm.protocol import ChatModel, Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.models.vlm.structured import ForgettingChat, ask, probe
from manitwin.twin.point_records import FunctionalPoint
from manitwin.twin.record import Language

PROMPTS: dict[AnnotatorQuestion, tuple[str, ...]] = {
    "quality": ("quality",),
    "physical": ("physical",),
    "captions": ("captions",),
    "points": ("functional_points", "grasp_points", "closer_look"),
}
"""Prompts of each question."""

VIEWS = 8
PICTURES = {"functional_points": 2 * VIEWS, "grasp_points": 2 * VIEWS, "closer_look": 2 * len(LETTERS)}
"""Number of pictures of the prompts that have more than the eight views: each view without and with markers."""

ANSWER_TOKENS = {
    "quality": 500, "physical": 700, "captions": 600, "functional_points": 500, "grasp_points": 500, "closer_look": 300,
}  # fmt: skip
"""Approximate tokens of an answer: those of ``fakes.vlm_answers`` have 250 to 500; models are wordier."""

VALUES_CHARACTERS = 200
"""Approximate characters of the values that fill a prompt's placeholders, without the list of ids."""

LISTED_CHARACTERS = {"functional_points": 16, "grasp_points": 24}
"""Characters per candidate in the list of ids and in the enum of the schema."""


class VlmAnnotator:
    """Annotator that asks a chat model, and asks again if an answer contradicts geometry or priors.

    A contradiction that stays is reported as a finding. Raises the errors of the chat model, BadReply for an unusable answer,
    Rejected for an impossible size or mass, and ConfigError for invalid prompts.
    """

    needs: Resource = "vlm"

    def __init__(self, chat: ChatModel, config: BuildConfig):
        """Take the model and the settings, and read the prompts."""
        self.chat, self.config = chat, config
        self.name = chat.name
        self.picture_px = config.vlm.picture_px
        self.prompts: dict[str, Prompt] = load_prompts(config.vlm.prompts)

    def model_for(self, question: AnnotatorQuestion) -> str:
        """Return 'MODEL, prompt quality v1 0123abcd': model, prompt versions, and a digest of prompts, schemas and settings."""
        names = PROMPTS[question]
        versions = " and ".join(f"{name} v{self.prompts[name].version}" for name in names)
        return f"{self.chat.model}, prompt {versions} {self._digests[question]}"

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return the approximate cost of a question that is asked once; 0 if the chat model has no price."""
        price = getattr(self.chat, "price", None)
        if price is None:
            return 0.0
        return sum(
            self._queries(name)
            * expected_usd(
                price,
                characters=self._characters(name),
                pictures=PICTURES.get(name, VIEWS),
                picture_px=self.picture_px,
                answer_tokens=ANSWER_TOKENS[name],
            )
            for name in PROMPTS[question]
        )

    def probe(self) -> str:
        """Ask one small question with a picture; return the result as a short phrase."""
        return probe(self.chat)

    @cached_property
    def template_reader(self) -> TemplateReader:
        """Reader that fills in templates for built-in generators."""
        return TemplateReader(self.chat, self.config.vlm, self.prompts)

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Judge the two criteria, with the photos if there are any; an answer that is unsure when asked twice counts as no."""
        question = quality_question(subject, self.prompts["quality"], self.picture_px)
        return quality_verdict(ask(self.chat, question, quality_answer(subject), examine_quality).value)

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Estimate size, mass and contact properties; raises Rejected for values that are impossible when asked twice."""
        question, mesh = physical_question(subject, self.prompts["physical"]), measure(subject)

        def check(answer: PhysicalAnswer) -> list[PhysicalFinding]:
            return examine_physical(answer, mesh, subject.name, self.config.physical)

        answered = ask(self.chat, question, PhysicalAnswer, texts(check))
        reject_impossible(check(answered.value))
        return physical_estimates(
            answered.value,
            subject,
            self.chat.model,
            outer_skin=mesh.is_outer_skin(answered.value),
            findings=answered.findings,
        )

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Describe the object; inadmissible sentences are left out. Raises BadReply if too few remain."""
        question = captions_question(subject, material, extents_m, self.prompts["captions"])
        answered = ask(
            self.chat, question, CaptionsAnswer, lambda answer: caption_findings(answer, subject.name, extents_m)
        )
        try:
            return admissible_language(answered.value, subject.name, extents_m)
        except BadReply:
            self._forget(question)
            raise

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Choose functional points in one query, and grasp points by a vote over several concurrent queries.

        Each grasp query has its own views, order, numbering and wording.
        """
        checks = PlaceChecks(request)
        numbering = functional_numbering(request)
        answered = ask(
            self.chat,
            functional_question(request, numbering, self.prompts["functional_points"]),
            functional_answer(numbering.ids),
            lambda answer: examine_points(answer, numbering, checks),
        )
        functional, findings = functional_points(answered.value, numbering, checks)
        votes = self.config.vlm.votes
        queries = ask_concurrently([self._grasp_query(checks, vote, votes) for vote in range(votes)])
        cast = [ballot for query in queries for ballot in query]
        grasp, more = elect_grasps(cast, votes, checks)
        spare = spare_grasps(cast, votes, checks, [point.candidate for point in grasp])
        return SelectedPoints(functional, grasp, findings + more, spare)

    def look_closer(self, request: PointsRequest, points: Sequence[FunctionalPoint]) -> CloserLook:
        """Choose for each point the best of twelve places around it, in one query with a close-up picture of each point."""
        nearby = nearby_places(PlaceChecks(request), points, self.picture_px)
        if not nearby:
            return CloserLook()
        pictures = nearby_pictures(request, nearby)
        question = closer_question(request, nearby, pictures, self.prompts["closer_look"])
        places = chosen_places(ask(self.chat, question, closer_answer(nearby)).value, nearby)
        return CloserLook(places, {each.point.id: marked for each, marked in zip(nearby, pictures.marked, strict=True)})

    def questions(
        self, request: PointsRequest, material: str, extents_m: np.ndarray, chosen: Sequence[FunctionalPoint] = ()
    ) -> list[Question]:
        """Return all questions about an object in a build, the grasp votes last, without asking them.

        The closer look is included if the ``chosen`` functional points, at their candidates, are given.
        """
        subject, prompts, checks, votes = request.subject, self.prompts, PlaceChecks(request), self.config.vlm.votes
        grasps = [
            grasp_question(checks, grasp_numbering(request, vote, votes), prompts["grasp_points"], vote)
            for vote in range(votes)
        ]
        nearby = nearby_places(checks, chosen, self.picture_px)
        closer = list[Question]()
        if nearby:
            closer.append(closer_question(request, nearby, nearby_pictures(request, nearby), prompts["closer_look"]))
        # name and size are known only after the physical question
        unknown = replace(subject, known_as=None, metric=not subject.size_estimated)
        return [
            quality_question(unknown, prompts["quality"], self.picture_px),
            physical_question(unknown, prompts["physical"]),
            captions_question(subject, material, extents_m, prompts["captions"]),
            functional_question(request, functional_numbering(request), prompts["functional_points"]),
            *closer,
            *grasps,
        ]

    def _grasp_query(self, checks: PlaceChecks, vote: int, votes: int) -> Callable[[], list[Ballot]]:
        """Return a function that asks one of the grasp queries; its pictures are rendered here, in the calling thread."""
        numbering = grasp_numbering(checks.request, vote, votes)
        question = grasp_question(checks, numbering, self.prompts["grasp_points"], vote)

        def ballots_of_query() -> list[Ballot]:
            answered = ask(
                self.chat,
                question,
                grasp_answer(numbering.ids),
                lambda answer: examine_points(answer, numbering, checks),
            )
            return ballots(answered.value, numbering, checks, vote)

        return ballots_of_query

    def _forget(self, question: Question) -> None:
        # a cached answer that is unusable would be unusable again
        if isinstance(self.chat, ForgettingChat):
            self.chat.forget(question)

    @cached_property
    def _digests(self) -> dict[AnnotatorQuestion, str]:
        settings = self.config.vlm.model_dump(mode="json", include={"picture_px", "max_tokens", "temperature"})
        digests: dict[AnnotatorQuestion, str] = {}
        for question, names in PROMPTS.items():
            votes = self.config.vlm.votes if question == "points" else 1
            asked = [(self.prompts[n].text, strict_schema(_FORMS[n])) for n in names]
            text = json.dumps([asked, settings, votes], sort_keys=True)
            digests[question] = hashlib.sha256(text.encode()).hexdigest()[:8]
        return digests

    def _queries(self, prompt: str) -> int:
        return self.config.vlm.votes if prompt == "grasp_points" else 1

    def _characters(self, name: str) -> int:
        prompt = self.prompts[name]
        schema = json.dumps(strict_schema(_FORMS[name]))
        listed = LISTED_CHARACTERS.get(name, 0) * self.config.candidates.count
        return len(prompt.instructions) + len(prompt.question) + len(schema) + VALUES_CHARACTERS + listed


_FORMS: dict[str, type[BaseModel]] = {
    "quality": QualityBesidePhotoAnswer,
    "physical": PhysicalAnswer,
    "captions": CaptionsAnswer,
    "functional_points": functional_answer(["1"]),
    "grasp_points": grasp_answer(["1"]),
    "closer_look": CLOSER_FORM,
}


class OpenAiAnnotator(VlmAnnotator):
    """``openai:MODEL`` or ``openai:MODEL@URL``: any server with OpenAI's chat completions API."""

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> OpenAiAnnotator:
        """Create it; raises ConfigError for a missing model or key, or an unknown price."""
        return cls(openai_from_spec(argument, config), config)


class AnthropicAnnotator(VlmAnnotator):
    """``anthropic:MODEL`` or ``anthropic:MODEL@URL``: any server with Anthropic's Messages API."""

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> AnthropicAnnotator:
        """Create it; raises ConfigError for a missing model or key, or an unknown price."""
        return cls(anthropic_from_spec(argument, config), config)


class ReplayAnnotator(VlmAnnotator):
    """``replay:FILE``: the recorded answers of an earlier run."""

    @classmethod
    def from_spec(cls, argument: str, config: BuildConfig) -> ReplayAnnotator:
        """Create it; raises ConfigError for a file that is missing or has no answers."""
        return cls(replay_from_spec(argument, config), config)
