# SPDX-License-Identifier: Apache-2.0
"""Trains YOLOv7 or the improved YOLOv7 on COCO, or on sequences of `stillmap simulate`.

  python -m networks.train COCO_ROOT --improved --out build/yolov7_improved
  python -m networks.train SEQUENCES --improved --width 0.25 --size 256 320 --epochs 20 --out build/yolov7_small

The defaults are the settings of YOLOv7 for COCO (SGD with momentum, linear warm-up, cosine schedule, moving average of
the weights): the paper of the improved network names none. OUT receives best.pt, last.pt and log.jsonl (a line per
epoch).
With --architecture yolo11n or yolov8n-seg the training is done by the package ultralytics; see fine_tune.py.
"""
import argparse
import copy
import json
import math
import time
from pathlib import Path

import torch
from torch.utils.data import DataLoader

from networks import fine_tune, yolov7
from networks.data import ImageDataset, collate, read_samples, seed_worker
from networks.evaluate import evaluate
from networks.loss import Loss

MOMENTUM, WARMUP_MOMENTUM, WEIGHT_DECAY = 0.937, 0.8, 5e-4
WARMUP_EPOCHS, WARMUP_BIAS_RATE, FINAL_RATE = 3, 0.1, 0.1
NOMINAL_BATCH = 64  # images per update of the weights
EMA_DECAY, EMA_RAMP = 0.9999, 2000


class MovingAverage:
    """Exponential moving average of the weights; the averaged weights are evaluated and saved."""

    def __init__(self, network):
        self.network, self.updates = copy.deepcopy(network).eval().requires_grad_(False), 0

    def update(self, network):
        self.updates += 1
        decay = EMA_DECAY * (1 - math.exp(-self.updates / EMA_RAMP))
        current = network.state_dict()
        for name, value in self.network.state_dict().items():
            if value.dtype.is_floating_point:
                value.lerp_(current[name], 1 - decay)
            else:
                value.copy_(current[name])


def make_optimizer(network, rate, adam=False):
    """SGD with Nesterov momentum, or Adam, in three groups: biases, weights with decay, and all other parameters."""
    biases, decayed, others = [], [], []
    for name, parameter in network.named_parameters():
        group = biases if name.endswith("bias") else decayed if parameter.dim() > 1 else others
        group.append(parameter)
    groups = [{"params": biases}, {"params": decayed, "weight_decay": WEIGHT_DECAY}, {"params": others}]
    if adam:
        return torch.optim.AdamW(groups, lr=rate, betas=(MOMENTUM, 0.999), weight_decay=0)
    return torch.optim.SGD(groups, lr=rate, momentum=MOMENTUM, nesterov=True)


def cosine(progress):
    """Factor of the learning rate at a share of the training [0..1]: from 1 to FINAL_RATE."""
    return FINAL_RATE + (1 - FINAL_RATE) * (1 + math.cos(math.pi * progress)) / 2


class Schedule:
    """Learning rates and momentum: warm-up over the first epochs, then cosine."""

    def __init__(self, optimizer, rate, epochs, steps_per_epoch, warmup_epochs):
        self.optimizer, self.rate, self.total = optimizer, rate, epochs * steps_per_epoch
        self.warmup = max(1, min(round(warmup_epochs * steps_per_epoch), self.total // 2))

    def set(self, step):
        target = self.rate * cosine(step / self.total)
        warm = min(1.0, step / self.warmup)
        for index, group in enumerate(self.optimizer.param_groups):
            start = WARMUP_BIAS_RATE if index == 0 else 0.0
            group["lr"] = target * warm if "betas" in group else start + (target - start) * warm
            group["momentum"] = WARMUP_MOMENTUM + (MOMENTUM - WARMUP_MOMENTUM) * warm


class Trainer:
    def __init__(self, network, loader, settings):
        self.device = settings.device
        self.network = network.to(self.device, memory_format=torch.channels_last)
        self.average = MovingAverage(self.network)
        self.loader, self.settings = loader, settings
        self.loss = Loss(network.classes, *settings.size, device=self.device)
        self.accumulate = max(1, round(settings.nominal_batch / settings.batch))
        self.optimizer = make_optimizer(self.network, settings.rate, settings.adam)
        self.schedule = Schedule(self.optimizer, settings.rate, settings.epochs, len(loader), settings.warmup)
        self.step = 0

    def train_batch(self, images, targets):
        self.schedule.set(self.step)
        images = images.to(self.device, memory_format=torch.channels_last)
        targets = [(boxes.to(self.device), classes.to(self.device)) for boxes, classes in targets]
        with torch.autocast(self.device, torch.bfloat16, enabled=self.settings.bfloat16):
            heads = self.network(images)
        loss, parts = self.loss(heads, targets)
        (loss * NOMINAL_BATCH / self.accumulate).backward()  # YOLOv7 sums the loss over 64 images
        self.step += 1
        if self.step % self.accumulate == 0:
            self.optimizer.step()
            self.optimizer.zero_grad()
            self.average.update(self.network)
        return parts

    def train_epoch(self):
        """Returns the mean box, objectness and class loss."""
        self.network.train()
        sums, batches = [0.0, 0.0, 0.0], 0
        for images, targets in self.loader:
            parts = self.train_batch(images, targets)
            sums, batches = [a + b for a, b in zip(sums, parts)], batches + 1
            if batches % 20 == 0:
                print(f"  batch {batches}/{len(self.loader)}: loss {sum(sums) / batches:.4f}", flush=True)
        return [part / batches for part in sums]


def train(settings):
    torch.manual_seed(settings.seed)
    torch.set_num_threads(settings.threads)
    settings.out.mkdir(parents=True, exist_ok=True)
    network, names = yolov7.load(settings.weights) if settings.weights else (None, None)
    samples, names = read_samples(settings.data, "train", names)
    held_out, _ = read_samples(settings.data, "val", names)
    dataset = ImageDataset(samples, settings.size, augment=True, cache=settings.cache, mosaic=settings.mosaic,
                        strength=settings.augmentation)
    loader = DataLoader(dataset, settings.batch, shuffle=True, drop_last=True, collate_fn=collate,
                        num_workers=settings.workers, worker_init_fn=seed_worker)
    network = network or yolov7.YOLOv7(len(names), ghost=settings.improved, attention=settings.improved,
                                       width=settings.width, reading=settings.reading)
    trainer, best = Trainer(network, loader, settings), -1.0
    with (settings.out / "log.jsonl").open("a", encoding="utf-8") as log:
        for epoch in range(settings.epochs):
            begin = time.monotonic()
            box, objectness, class_loss = trainer.train_epoch()
            row = {"epoch": epoch + 1, "seconds": round(time.monotonic() - begin),
                   "loss": box + objectness + class_loss, "box": box, "objectness": objectness, "class": class_loss}
            last = epoch + 1 == settings.epochs
            if last or (epoch + 1) % settings.evaluate_every == 0:
                row |= evaluate(trainer.average.network, names, held_out, settings.size, settings.device)
            print(json.dumps(row), flush=True)
            log.write(json.dumps(row) + "\n")
            log.flush()
            yolov7.save(trainer.average.network, names, settings.out / "last.pt")
            if row.get("map", -1.0) > best:
                best = row["map"]
                yolov7.save(trainer.average.network, names, settings.out / "best.pt")


def parse_arguments(words=None):
    parser = argparse.ArgumentParser(prog="python -m networks.train", description=__doc__.splitlines()[0],
                                     epilog=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, help="COCO root, or folder of simulated sequences train* and val*")
    parser.add_argument("--architecture", choices=["yolov7", *fine_tune.PRETRAINED], default="yolov7")
    parser.add_argument("--improved", action="store_true", help="GhostConv and Conv_SE in ELAN-1 and ELAN-2")
    parser.add_argument("--reading", choices=list(yolov7.READINGS), default="places",
                        help="interpretation of the paper's ELAN-1 and ELAN-2 (--improved); default: %(default)s")
    parser.add_argument("--width", type=float, default=1.0, help="factor on all channel numbers")
    parser.add_argument("--size", type=int, nargs=2, default=[640, 640], metavar=("HEIGHT", "WIDTH"))
    parser.add_argument("--epochs", type=int, help="300; with ultralytics 500")
    parser.add_argument("--batch", type=int, default=16)
    parser.add_argument("--nominal-batch", type=int, default=NOMINAL_BATCH,
                        help="images per update; gradients of smaller batches are accumulated")
    parser.add_argument("--rate", type=float, help="initial learning rate: 0.01; with ultralytics 0.001")
    parser.add_argument("--adam", action="store_true", help="Adam instead of SGD, for short trainings (--rate 0.001)")
    parser.add_argument("--warmup", type=float, default=WARMUP_EPOCHS, help="epochs of warm-up")
    parser.add_argument("--mosaic", type=float, default=1.0, help="share of mosaics of four images [0..1]")
    parser.add_argument("--augmentation", type=float, default=1.0,
                        help="factor on the ranges of scale, translation and color [0..1]")
    parser.add_argument("--weights", type=Path, help="network to continue from (.pt)")
    parser.add_argument("--evaluate-every", type=int, default=1, help="epochs between evaluations")
    parser.add_argument("--cache", action="store_true", help="keep all images in memory")
    parser.add_argument("--bfloat16", action="store_true", help="compute the network in bfloat16")
    parser.add_argument("--device", default="cuda" if torch.cuda.is_available() else "cpu")
    parser.add_argument("--workers", type=int, default=0, help="processes that load images")
    parser.add_argument("--threads", type=int, default=torch.get_num_threads())
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, required=True)
    settings = parser.parse_args(words)
    of_ultralytics = settings.architecture != "yolov7"
    settings.epochs = settings.epochs or (fine_tune.EPOCHS if of_ultralytics else 300)
    settings.rate = settings.rate or (fine_tune.RATE if of_ultralytics else 0.01)
    if any(n % 32 for n in settings.size):
        parser.error("--size must be divisible by 32")
    return settings


def main(words=None):
    settings = parse_arguments(words)
    if settings.architecture == "yolov7":
        train(settings)
    else:
        fine_tune.train(settings)


if __name__ == "__main__":
    main()
