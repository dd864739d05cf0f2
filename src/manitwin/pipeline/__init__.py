"""The pipeline of the paper: one module per stage, listed in order by ``recipe``.

Stages in order, with the corresponding sections of the paper (figure 2):

I. Asset Generation: ``photo``, ``generate`` ("3D Generation"); ``mesh``, ``views``, ``gate`` ("Quality Verification");
``physical`` ("Physical Property Estimation"); ``collision``, ``placement``; ``caption`` ("Semantic Captioning").

II. Asset Annotation: ``candidates`` ("Candidate Point Sampling"); ``points`` ("VLM-Based Point Selection"); ``grasps``, with
``proposals`` ("Grasp Proposal Generation", "Spatial Filtering and Semantic Association").

III. Verification: ``verify``, ``second_opinion``, ``robustness`` ("Simulation Verification"); ``record_grasps``, ``finish``
("Consolidated Output").
"""
