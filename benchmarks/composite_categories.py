"""Categories of composites, fixed to those with which the shipped networks and confidence models were trained.

Pictures are drawn from a seed and a position in this list. A different list would give different pictures and different figures,
so templates added later are not included.
"""

from __future__ import annotations

COMPOSITE_CATEGORIES = tuple(
    """
aerosol can, allen key, axe, basket, battery, bell, book, bottle, bowl, box, bracelet, brick, bucket, calculator,
camera, can, candle, candle holder, chef's knife, chisel, chopstick, cleaning brush, clothes hanger, clothespin,
coin, comb, computer mouse, cooking spoon, cup, curtain ring, cutting board, dental floss, deodorant, dice, drink
can, dumbbell, dustpan, electric toothbrush, eraser, flashlight, flower pot, fork, frying pan, funnel, gear, glass,
glass bottle, glue stick, hair dryer, hairbrush, hammer, hand mirror, headphones, jar, key, keyboard, knife, ladle,
light bulb, marker, measuring cup, mixing bowl, mobile phone, mortar, mug, notebook, nut, padlock, paint brush,
paring knife, pen, pen holder, pencil, pencil sharpener, pepper mill, pet bowl, picture frame, pill bottle, pitcher,
plate, pliers, plunger, pot, pot lid, power bank, pump bottle, putty knife, razor, remote control, ring, roll of
tape, rolling pin, router, ruler, salt shaker, saucepan, saucer, screwdriver, serving tray, shampoo bottle, soap,
spatula, speaker, sponge, spoon, spray bottle, stapler, tablet, tape dispenser, teapot, tennis ball, thermos, tissue
box, toilet paper, toothbrush, toothpaste, trash can, trowel, umbrella, usb stick, vase, water bottle, watering can,
whisk, wine glass, wok, wrench
""".replace("\n", " ")
    .strip()
    .split(", ")
)
"""Categories sorted by name. Every fourth one is in no training picture (``composite_things.is_unseen``)."""
